/** Mouse, finger and keys draw; two fingers and the wheel look closer. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./drawing.js').Pixel} Pixel */
/** @typedef {import('./drawing_view.js').DrawingView} DrawingView */

/** Sides of the pens, [m]; the first is one pixel. */
const SIZES = [0, 0.25, 0.5];
/** @type {Record<string, Pixel>} */
const STEPS = {ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1]};

export class Pen {
  /**
   * @param {DrawingView} view
   * @param {Page} page
   * @param {HTMLElement} told Where is said what keys have come to.
   */
  constructor(view, page, told) {
    this.isWall = true;
    /** 0 for thin, 1, 2 for thick. */
    this.thickness = 0;
    /** Called after each stroke. */
    this.onStroke = () => {};
    this._view = view;
    this._page = page;
    this._told = told;
    /** @type {Map<number, {x: number, y: number}>} */
    this._fingers = new Map();
    /** @type {Pixel | null} */
    this._last = null;
    this._listen(view.canvas);
  }

  /** @returns {number} Side of the pen, [pixels]. */
  get size() {
    const {resolution} = this._view.drawing;
    return Math.max(this.thickness + 1, Math.round((SIZES[this.thickness] ?? 0) / resolution));
  }

  /** @param {HTMLCanvasElement} canvas */
  _listen(canvas) {
    canvas.addEventListener('wheel', event => {
      event.preventDefault();
      this._view.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
    }, {passive: false});
    canvas.addEventListener('pointerdown', event => this._down(event));
    canvas.addEventListener('pointermove', event => this._move(event));
    canvas.addEventListener('lostpointercapture', event => this._up(event));
    canvas.addEventListener('keydown', event => this._key(event));
    canvas.addEventListener('focus', () => canvas.matches(':focus-visible') && this._cursor());
    canvas.addEventListener('blur', () => this._hideCursor());
  }

  /** @param {PointerEvent} event */
  _down(event) {
    if (event.button !== 0) {
      return;
    }
    this._view.canvas.setPointerCapture(event.pointerId);
    this._fingers.set(event.pointerId, {x: event.offsetX, y: event.offsetY});
    this._hideCursor();
    if (this._fingers.size > 1) {
      this._takeBack();
      return;
    }
    this._view.drawing.begin();
    this._drawTo(this._view.pixelAt(event.offsetX, event.offsetY));
  }

  /** The first of two fingers has drawn a dab that nobody wanted. */
  _takeBack() {
    if (this._last) {
      this._last = null;
      this._view.drawing.undo();
    }
  }

  /** @param {PointerEvent} event */
  _move(event) {
    const before = this._fingers.get(event.pointerId);
    if (!before) {
      return;
    }
    if (this._fingers.size > 1) {
      this._pinch(event, before);
    } else if (this._last) {
      for (const each of event.getCoalescedEvents?.() ?? [event]) {
        this._drawTo(this._view.pixelAt(each.offsetX, each.offsetY));
      }
      this._drawTo(this._view.pixelAt(event.offsetX, event.offsetY));
    }
    this._fingers.set(event.pointerId, {x: event.offsetX, y: event.offsetY});
  }

  /** @param {PointerEvent} event @param {{x: number, y: number}} before */
  _pinch({pointerId, offsetX: x, offsetY: y}, before) {
    const other = [...this._fingers].find(([id]) => id !== pointerId)?.[1] ?? before;
    const apart = Math.max(Math.hypot(before.x - other.x, before.y - other.y), 1);
    this._view.zoom(Math.hypot(x - other.x, y - other.y) / apart, other.x, other.y);
    this._view.pan((x - before.x) / 2, (y - before.y) / 2);
  }

  /** @param {PointerEvent} event */
  _up(event) {
    this._fingers.delete(event.pointerId);
    if (this._last) {
      this._end();
    }
  }

  /** @param {Pixel} to */
  _drawTo(to) {
    this._view.drawing.line(this._last ?? to, to, this.size, this.isWall);
    this._last = to;
  }

  _end() {
    this._last = null;
    this._view.drawing.end();
    this.onStroke();
  }

  // Keys

  /** @param {KeyboardEvent} event Arrows move the pen, with shift they draw, as Enter does. */
  _key(event) {
    const step = STEPS[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey || (!step && event.key !== 'Enter')) {
      return;
    }
    event.preventDefault();
    const cursor = this._cursor();
    const from = cursor.pixel;
    if (step) {
      cursor.pixel = this._within([from[0] + step[0] * this.size, from[1] + step[1] * this.size]);
    }
    if (!step || event.shiftKey) {
      this._view.drawing.begin();
      this._view.drawing.line(from, cursor.pixel, this.size, this.isWall);
      this._end();
    }
    this._tell(cursor.pixel);
    this._view.refresh();
  }

  /** @param {Pixel} pixel @returns {Pixel} */
  _within([row, col]) {
    const {rows, cols} = this._view.drawing;
    return [Math.min(rows - 1, Math.max(0, row)), Math.min(cols - 1, Math.max(0, col))];
  }

  /** Show where keys draw: only who uses them sees it. */
  _cursor() {
    const {drawing, cursor} = this._view;
    const pixel = cursor && drawing.contains(cursor.pixel) ? cursor.pixel
      : /** @type {Pixel} */ ([Math.floor(drawing.rows / 2), Math.floor(drawing.cols / 2)]);
    this._view.cursor = {pixel, size: this.size};
    this._view.refresh();
    return this._view.cursor;
  }

  _hideCursor() {
    this._view.cursor = null;
    this._view.refresh();
  }

  /** @param {Pixel} pixel Say where the pen is and what is there. */
  _tell(pixel) {
    const {drawing} = this._view;
    const place = /** @param {0 | 1} axis @param {number} at */ (axis, at) => (
      this._page.words.number(drawing.origin[axis] + (at + 0.5) * drawing.resolution, 2));
    this._told.textContent = this._page.t(
      drawing.isWall(pixel) ? 'worlds.at_wall' : 'worlds.at_free',
      {x: place(0, pixel[1]), y: place(1, pixel[0])});
  }
}

/**
 * Make the choice of pens.
 *
 * @param {Pen} pen
 * @param {Page} page
 * @returns {HTMLElement}
 */
export function makePens(pen, page) {
  return element('div', {class: 'pens'},
    choice(page, 'pen', ['wall', 'erase'], at => {
      pen.isWall = at === 0;
    }),
    choice(page, 'thickness', ['thin', 'medium', 'thick'], at => {
      pen.thickness = at;
    }));
}

/**
 * @param {Page} page
 * @param {string} name
 * @param {string[]} options The first is chosen.
 * @param {(at: number) => void} choose
 */
function choice(page, name, options, choose) {
  return element('fieldset', {class: 'choice'},
    element('legend', {class: 'unseen'}, page.t(`worlds.${name}`)),
    ...options.map((option, at) => element('label', {},
      element('input', {type: 'radio', name: `worlds-${name}`, value: option, checked: at === 0,
        onchange: () => choose(at)}),
      page.t(`worlds.${option}`))));
}
