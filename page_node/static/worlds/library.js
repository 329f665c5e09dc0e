/** The worlds there are, each with a small picture. */

import {pixel, readColours} from '../live/colours.js';
import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {{name: string, own: boolean, changed: number}} World */

/** Longest side of a small picture, [pixels]. */
const SMALL = 64;

export class Library {
  /** @param {Page} page @param {(name: string) => void} choose Called with the one that is tapped. */
  constructor(page, choose) {
    this._page = page;
    this._choose = choose;
    /** @type {World[]} */
    this.worlds = [];
    this.inUse = '';
    this.root = element('div', {class: 'library', role: 'group',
      'aria-label': page.t('worlds.library')});
  }

  /** Ask which there are. */
  async load() {
    try {
      const {worlds, in_use: inUse} = await this._page.json('/api/worlds');
      this.worlds = worlds;
      this.inUse = inUse;
    } catch {
      return;
    }
    const focused = this.root.contains(document.activeElement)
      ? /** @type {HTMLElement} */ (document.activeElement).dataset.world : '';
    this.root.replaceChildren(...this.worlds.map(world => this._button(world)));
    if (focused) {
      /** @type {HTMLElement | null} */ (
        this.root.querySelector(`[data-world="${focused}"]`))?.focus();
    }
  }

  /** @param {string} name Mark the one that is drawn on. */
  mark(name) {
    for (const button of this.root.children) {
      button.setAttribute(
        'aria-pressed', String(/** @type {HTMLElement} */ (button).dataset.world === name));
    }
  }

  /** @param {string} name @returns {World | undefined} */
  find(name) {
    return this.worlds.find(world => world.name === name);
  }

  /** @param {World} world @returns {HTMLElement} */
  _button(world) {
    const canvas = element('canvas', {'aria-hidden': true, width: SMALL, height: SMALL});
    void this._paint(canvas, world);
    return element('button', {type: 'button', class: 'world', 'data-world': world.name,
      'aria-pressed': 'false', onclick: () => this._choose(world.name)}, canvas,
    element('span', {}, world.name),
    world.name === this.inUse && element('small', {}, this._page.t('worlds.in_use')));
  }

  /** @param {HTMLCanvasElement} canvas @param {World} world */
  async _paint(canvas, {name, changed}) {
    /** @type {any} */
    let frame;
    try {
      frame = await this._page.binary(`/api/worlds/${name}?most=${SMALL}&v=${changed}`);
    } catch {
      return;
    }
    const {rows, cols, occupancy} = frame;
    const colours = readColours();
    const image = new ImageData(cols, rows);
    const pixels = new Uint32Array(image.data.buffer);
    const [free, wall] = [pixel(colours.free), pixel(colours.wall)];
    for (let at = 0; at < pixels.length; at++) {
      const row = rows - 1 - Math.floor(at / cols);
      pixels[at] = occupancy[row * cols + at % cols] ? wall : free;
    }
    canvas.width = cols;
    canvas.height = rows;
    canvas.getContext('2d')?.putImageData(image, 0, 0);
  }
}
