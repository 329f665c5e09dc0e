/** Keys: arrows and the letters of teleop drive, space stops, letters teach. */

/** @typedef {import('../page.js').Page} Page */

/** What a held key adds. @type {Record<string, readonly [number, number]>} */
const MOVES = {
  arrowup: [1, 0], arrowdown: [-1, 0], arrowleft: [0, 1], arrowright: [0, -1],
  u: [1, 1], i: [1, 0], o: [1, -1], j: [0, 1], l: [0, -1],
  m: [-1, -1], ',': [-1, 0], '.': [-1, 1],
};
const STOPS = [' ', 'k'];

/** What a letter asks for: those of teleop. @type {Record<string, string>} */
export const LETTERS = {
  s: 'start', n: 'keep', r: 'redo', a: 'cancel', d: 'drop_last', b: 'undo', t: 'run_trials',
  y: 'label_success', f: 'label_failure', g: 'set_back', h: 'teach_here',
  q: 'faster', w: 'faster', e: 'faster', z: 'slower', x: 'slower', c: 'slower',
};

/** Where keys are meant for what has the focus. */
const WRITING = 'input:not([type=range]):not([type=checkbox]):not([type=radio])' +
  ':not([type=button]), textarea, [contenteditable]';
/** What a browser ticks by space alone, which stops here: Enter does it, as it presses buttons. */
const TICKED = 'input[type=checkbox], input[type=radio]';
const CHOOSING = 'select, input, [role=slider], [role=listbox], [data-keys]';
/** Where letters choose as well: who has just chosen how many tries wants to press t. */
const LETTERING = 'select, [role=listbox], [data-keys]';

export class Keys {
  /** @param {Page} page */
  constructor(page) {
    this._page = page;
    /** @type {Set<string>} */
    this._held = new Set();
    addEventListener('keydown', event => this._down(event), {capture: true});
    addEventListener('keyup', event => this._up(event), {capture: true});
    // Who has chosen with the pointer, or begins something, wants the arrows to drive.
    addEventListener('click', event => event.detail > 0 && leave(event));
    page.next('released', () => this._held.clear());
  }

  /** @param {KeyboardEvent} event */
  _down(event) {
    const key = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey || event.altKey || isIn(event, WRITING)) {
      return;
    }
    if (key === ' ' || (STOPS.includes(key) && !isIn(event, CHOOSING))) {
      this._stop(event);
    } else if (key === 'enter' && isIn(event, TICKED)) {
      /** @type {HTMLElement} */ (event.target).click();
    } else if (this._page.room === 'teach' && !isIn(
      event, key.startsWith('arrow') ? CHOOSING : LETTERING)) {
      this._drive(event, key);
    }
  }

  /**
   * Space stops whatever has the focus, so that nobody has to look first; Enter presses.
   *
   * @param {KeyboardEvent} event
   */
  _stop(event) {
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) {
      this._page.drive.stop();
    }
  }

  /** @param {KeyboardEvent} event @param {string} key */
  _drive(event, key) {
    const action = LETTERS[key];
    if (key in MOVES) {
      event.preventDefault();
      if (!event.repeat) {
        this._held.add(key);
        this._hold();
      }
    } else if (action && !event.repeat) {
      leave(event);
      this._page.tell({type: 'asked', action});
    }
  }

  /** @param {KeyboardEvent} event */
  _up(event) {
    const key = event.key.toLowerCase();
    if (key === ' ' && !isIn(event, WRITING)) {
      event.preventDefault();
      event.stopPropagation();
    }
    if (this._held.delete(key)) {
      this._hold();
    }
  }

  /** Drive as all keys together say. */
  _hold() {
    const moves = [...this._held].map(key => MOVES[key] ?? [0, 0]);
    if (moves.length === 0) {
      this._page.drive.release('keys');
      return;
    }
    const sum = /** @param {0 | 1} part */ part => Math.max(
      -1, Math.min(1, moves.reduce((all, move) => all + (move[part] ?? 0), 0)));
    this._page.drive.hold('keys', sum(0), sum(1));
  }
}

/** Take the focus from what arrows would change. @param {Event} event */
function leave(event) {
  if (isIn(event, TICKED)) {
    /** @type {HTMLElement} */ (event.target).blur();
  }
}

/** @param {Event} event @param {string} selector @returns {boolean} */
function isIn(event, selector) {
  return event.target instanceof Element && event.target.closest(selector) !== null;
}
