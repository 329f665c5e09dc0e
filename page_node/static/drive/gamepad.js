/** A gamepad: sticks or cross drive, its buttons teach. */

/** @typedef {import('../page.js').Page} Page */

/** How often it is looked at, [ms]. */
const PERIOD = 25;
/** A stick that rests may say as much as this. */
const REST = 0.15;

/** Buttons of the standard layout. */
const [GO, STOP, TRY, REDO, UNDO, UP, DOWN, LEFT, RIGHT] = [0, 1, 2, 3, 8, 12, 13, 14, 15];

/** @type {Record<number, string>} */
const ACTIONS = {[GO]: 'go', [TRY]: 'run_trials', [REDO]: 'redo', [UNDO]: 'undo'};

export class Gamepads {
  /** @param {Page} page */
  constructor(page) {
    this._page = page;
    /** @type {Set<number>} */
    this._pressed = new Set();
    this._isNeutral = true;
    this._isThere = false;
    setInterval(() => this._look(), PERIOD);
    page.next('released', () => {
      this._isNeutral = false;
    });
  }

  _look() {
    const gamepad = document.hidden ? undefined : navigator.getGamepads().find(Boolean);
    if (Boolean(gamepad) !== this._isThere) {
      this._isThere = Boolean(gamepad);
      this._page.tell({type: 'gamepad', isThere: this._isThere});
      this._page.drive.release('gamepad');
    }
    if (gamepad) {
      this._buttons(gamepad);
      this._sticks(gamepad);
    }
  }

  /** @param {Gamepad} gamepad */
  _buttons(gamepad) {
    for (const [index, {pressed}] of gamepad.buttons.entries()) {
      if (pressed && !this._pressed.has(index)) {
        this._press(index);
      }
      this._pressed[pressed ? 'add' : 'delete'](index);
    }
  }

  /** @param {number} index */
  _press(index) {
    const action = ACTIONS[index];
    if (index === STOP) {
      this._page.drive.stop();
    } else if (action && this._page.room === 'teach') {
      this._page.tell({type: 'asked', action});
    }
  }

  /** @param {Gamepad} gamepad */
  _sticks(gamepad) {
    const {axes, buttons} = gamepad;
    const on = /** @param {number} index */ index => Number(buttons[index]?.pressed ?? false);
    const v = on(UP) - on(DOWN) || -beyondRest(axes[1] ?? 0);
    const w = on(LEFT) - on(RIGHT) || -beyondRest(axes[0] ?? 0) || -beyondRest(axes[2] ?? 0);
    // After a stop the sticks have to come to rest before they drive again.
    this._isNeutral ||= !v && !w;
    if ((v || w) && this._isNeutral && this._page.room === 'teach') {
      this._page.drive.hold('gamepad', v, w);
    } else {
      this._page.drive.release('gamepad');
    }
  }
}

/** @param {number} value @returns {number} */
function beyondRest(value) {
  const size = Math.min(1, Math.max(0, Math.abs(value) - REST) / (1 - REST));
  return Math.sign(value) * Math.round(size * 100) / 100;
}
