/** Who holds which way to drive, and what of it the server is told. */

import {Socket} from '../socket.js';

/** While something is held it is told this often, [ms]: the server stops at silence. */
const PERIOD = 50;
/** Bytes on their way at which a held command is not repeated: it would arrive too late. */
const BACKLOG = 2048;

/** @typedef {import('../page.js').Page} Page */
/** @typedef {readonly [v: number, w: number]} Move Shares of the speeds, -1 to 1. */

/** @type {Move} */
const STANDING = [0, 0];

export class Drive {
  /** @param {Page} page */
  constructor(page) {
    this._page = page;
    /** What is held, by what holds it: the last one counts. @type {Map<string, Move>} */
    this._held = new Map();
    /** @type {Move} */
    this._told = STANDING;
    this._share = 1;
    this._timer = 0;
    this._socket = new Socket('/drive', {
      message: data => this._hear(data),
      close: () => this.releaseAll(),
    });
    addEventListener('blur', () => this.releaseAll());
    addEventListener('pagehide', () => this.releaseAll());
    document.addEventListener('visibilitychange', () => document.hidden && this.releaseAll());
  }

  /** @returns {Move} What is asked for now. */
  get move() {
    const [v, w] = [...this._held.values()].at(-1) ?? STANDING;
    return [v * this._share, w * this._share];
  }

  /** @param {number} share Of the speeds, that all that is held comes to. */
  setShare(share) {
    this._share = share;
    this._tell();
  }

  /** @returns {boolean} Whether commands arrive. */
  get isConnected() {
    return this._socket.isOpen;
  }

  /**
   * Drive, for as long as it is not released.
   *
   * @param {string} source What holds it: keys, pad, gamepad.
   * @param {number} v
   * @param {number} w
   */
  hold(source, v, w) {
    this._held.set(source, [v, w]);
    this._tell();
  }

  /** @param {string} source Which lets go. */
  release(source) {
    if (this._held.delete(source)) {
      this._tell();
    }
  }

  /** Let go of everything: whoever held it has to take hold anew. */
  releaseAll() {
    this._held.clear();
    this._tell();
    this._page.tell({type: 'released'});
  }

  /** End drive, trial and series; by the other way, too, where the socket is gone. */
  stop() {
    this.releaseAll();
    if (!this._socket.send({stop: true})) {
      void this._page.act('stop');
    }
    this._page.tell({type: 'stopped'});
  }

  /** Tell every change at once, and what is held again and again. */
  _tell() {
    const [v, w] = this.move;
    if (v !== this._told[0] || w !== this._told[1]) {
      this._told = [v, w];
      this._send();
      this._page.tell({type: 'move', v, w});
    }
    if (v || w) {
      // One that runs is left alone: a gamepad holds anew more often than it is told.
      this._timer ||= setInterval(() => this._send(), PERIOD);
    } else {
      clearInterval(this._timer);
      this._timer = 0;
    }
  }

  _send() {
    const [v, w] = this._told;
    if (!(v || w) || this._socket.backlog < BACKLOG) {
      this._socket.send({t: performance.now(), v, w});
    }
  }

  /** @param {string} data */
  _hear(data) {
    const message = JSON.parse(data);
    if (message.type === 'driver') {
      this._page.tell(message);
    }
  }
}
