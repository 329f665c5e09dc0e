/** The room for worlds: choose one, draw it, bring one, keep it, and be in it. */

import {element} from '../dom.js';
import {makeZoom} from '../live/gestures.js';
import {Drawing} from './drawing.js';
import {DrawingView} from './drawing_view.js';
import {Library} from './library.js';
import {makePens, Pen} from './pen.js';
import {sayRefusal} from './refusals.js';
import {makeBring, makeNew} from './start.js';
import {frameFromDrawing, freeName} from './upload.js';
import {UseForm} from './use.js';

/** @typedef {import('../page.js').Page} Page */

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  void new Room(root, page).begin();
}

class Room {
  /** @param {HTMLElement} root @param {Page} page */
  constructor(root, page) {
    this._page = page;
    this._chosen = '';
    /** What was asked for last: it may come after what was asked for before. */
    this._wanted = '';
    const told = element('p', {class: 'unseen', 'aria-live': 'polite'});
    this._canvas = element('canvas', {tabindex: 0, role: 'application', 'data-keys': true,
      'aria-label': page.t('worlds.canvas'), 'aria-describedby': 'worlds-keys'});
    this._view = new DrawingView(this._canvas);
    this._pen = new Pen(this._view, page, told);
    this._library = new Library(page, name => void this._open(name));
    this._use = new UseForm(page, name => this._save(name), () => void this._refresh());
    this._bring = makeBring(page, (name, body) => this._upload(name, body));
    this._undo = this._button('undo', () => this._view.drawing.undo());
    this._redo = this._button('redo', () => this._view.drawing.redo());
    this._clear = this._button('clear', () => this._view.drawing.clear());
    this._pen.onStroke = () => this._showHistory();
    root.append(
      element('div', {class: 'shelf'}, this._library.root,
        makeNew(page, drawing => this._begin(drawing, this._freeName(page.t('worlds.new_name')))),
        this._bring.root),
      element('div', {class: 'board'},
        element('div', {class: 'tools'}, makePens(this._pen, page),
          element('div', {class: 'row'}, this._undo, this._redo, this._clear)),
        element('figure', {class: 'drawing'}, this._canvas,
          makeZoom(/** @type {any} */ (this._view), page)),
        element('p', {id: 'worlds-keys', class: 'help'}, page.t('worlds.keys')), told),
      this._use.root);
    this._takeDropped();
    page.on('robot', robot => this._showRobot(robot));
    // Somebody else may have put the robot elsewhere.
    page.next('truth', () => void this._refresh());
  }

  /** Show what there is, first of all the world that the robot is in. */
  async begin() {
    await this._library.load();
    await this._open(this._wanted || this._library.inUse || (this._library.worlds[0]?.name ?? ''));
  }

  /** @param {string} name @param {() => void} press */
  _button(name, press) {
    return element('button', {type: 'button', class: name, onclick: () => {
      press();
      this._showHistory();
    }}, this._page.t(`worlds.${name}`));
  }

  /** @param {string} name Draw on a world there is. */
  async _open(name) {
    if (!name) {
      return;
    }
    this._wanted = name;
    try {
      const frame = await this._page.binary(`/api/worlds/${name}`);
      const {rows, cols, resolution, origin, occupancy} = /** @type {any} */ (frame);
      if (this._wanted === name) {
        this._begin(new Drawing({rows, cols, resolution, origin}, occupancy), name);
      }
    } catch {
      this._page.say(this._page.t('worlds.no.unreadable'));
    }
  }

  /** @param {Drawing} drawing @param {string} name */
  _begin(drawing, name) {
    this._chosen = this._wanted = name;
    this._view.show(drawing);
    this._use.begin(name);
    this._library.mark(name);
    this._showHistory();
  }

  /** Keep what is drawn, if it is not what is kept. @param {string} name */
  async _save(name) {
    const {drawing} = this._view;
    const kept = this._library.find(name);
    if (kept && name === this._chosen && !drawing.isChanged) {
      return true;
    }
    if (kept && name !== this._chosen && kept.own &&
        !confirm(this._page.t('worlds.replace', {name}))) {
      return false;
    }
    const free = kept && !kept.own ? this._freeName(name) : name;
    if (!await this._send(free, frameFromDrawing(drawing))) {
      return false;
    }
    drawing.isChanged = false;
    this._chosen = free;
    this._use.name.value = free;
    await this._refresh();
    return true;
  }

  /** @param {string} name @param {Blob} body Keep a map that somebody brings, and draw on it. */
  async _upload(name, body) {
    const free = this._freeName(name || this._page.t('worlds.new_name'));
    if (!await this._send(free, body)) {
      return false;
    }
    await this._library.load();
    await this._open(free);
    return true;
  }

  /** @param {string} name @param {Blob} body @returns {Promise<boolean>} Whether it was taken. */
  async _send(name, body) {
    const answer = await this._page.post(`/api/worlds/${name}`, body);
    if (answer.success) {
      this._page.say(this._page.t('worlds.saved', {name}), (answer.notes ?? []).join(' '));
    } else {
      sayRefusal(this._page, answer);
    }
    return answer.success;
  }

  /** @param {string} name @returns {string} */
  _freeName(name) {
    return freeName(name, this._library.worlds.map(world => world.name));
  }

  async _refresh() {
    await this._library.load();
    this._library.mark(this._chosen);
  }

  _showHistory() {
    const {canUndo, canRedo} = this._view.drawing;
    this._undo.setAttribute('aria-disabled', String(!canUndo));
    this._redo.setAttribute('aria-disabled', String(!canRedo));
  }

  /** @param {any} robot */
  _showRobot(robot) {
    const shown = this._chosen === this._library.inUse ? robot : null;
    if (shown !== this._view.robot) {
      this._view.robot = shown;
      if (this._page.room === 'worlds') {
        this._view.refresh();
      }
    }
  }

  /** Take files that are dropped on the drawing. */
  _takeDropped() {
    this._canvas.addEventListener('dragover', event => event.preventDefault());
    this._canvas.addEventListener('drop', event => {
      event.preventDefault();
      void this._bring.take([...event.dataTransfer?.files ?? []]);
    });
  }
}
