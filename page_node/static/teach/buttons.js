/** The buttons to teach with: which of them are there now, and what they ask for. */

import {element, icon} from '../dom.js';
import {LETTERS} from '../drive/keys.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').State} State */

export const RECORDING = ['demonstration', 'settling'];
/** How long, and how often, a robot that is learning is asked again, [ms]. */
const PATIENCE = 20000;
const PAUSE = 300;
const SERIES = ['waiting', 'placing', 'starting', 'trial'];

/** @type {Record<string, string>} */
const PICTURES = {
  start: 'M12 5a7 7 0 100 14 7 7 0 000-14M12 10a2 2 0 100 4 2 2 0 000-4',
  keep: 'M5 13l5 5 9-11', redo: 'M5 5v5h5M5.5 10A7 7 0 1112 19', cancel: 'M6 6l12 12M18 6L6 18',
  run_trials: 'M8 5l11 7-11 7z', label_success: 'M5 13l5 5 9-11',
  label_failure: 'M6 6l12 12M18 6L6 18', undo: 'M9 6L4 11l5 5M4 11h10a5 5 0 010 10h-2',
  drop_last: 'M5 7h14M9 7V4h6v3M7 7l1 13h8l1-13', set_back: 'M11 6l-6 6 6 6M19 6l-6 6 6 6',
};

/**
 * Return why an action is not there now; empty if it is.
 *
 * @param {string} action
 * @param {State} state
 * @returns {string} A key of `why`.
 */
export function whyNot(action, state) {
  if (!state.nodes.learner) {
    return 'no_learner';
  }
  const isRecording = RECORDING.includes(state.phase);
  if (['keep', 'redo', 'cancel'].includes(action)) {
    return isRecording ? '' : 'nothing_recorded';
  }
  if (isRecording) {
    return 'recording';
  }
  if (isTrying(state)) {
    return 'trying';
  }
  return whatIsMissing(action, state);
}

/** @param {State} state @returns {boolean} Whether the robot drives by itself. */
export function isTrying({phase, trial, trials_left: left}) {
  return left > 0 || SERIES.includes(phase) || ['running', 'paused'].includes(trial.state);
}

/** @param {string} action @param {State} state @returns {string} */
function whatIsMissing(action, {prototypes, episodes, can_undo: canUndo}) {
  if (action === 'run_trials' && prototypes < 1) {
    return 'nothing_learnt';
  }
  if (['label_success', 'label_failure', 'drop_last'].includes(action) && !episodes) {
    return 'nothing_remembered';
  }
  return action === 'undo' && !canUndo ? 'nothing_to_undo' : '';
}

/**
 * Return what a person most likely wants to do next.
 *
 * @param {State} state
 * @returns {string}
 */
export function nextAction(state) {
  if (RECORDING.includes(state.phase)) {
    return 'keep';
  }
  return state.prototypes > 0 ? 'run_trials' : 'start';
}

export class Buttons {
  /**
   * @param {Page} page
   * @param {() => Record<string, object>} bodies What is sent with an action, by its name.
   */
  constructor(page, bodies) {
    this._page = page;
    this._bodies = bodies;
    /** @type {Map<string, HTMLButtonElement>} */
    this._buttons = new Map();
    this._busy = '';
  }

  /** @param {string} action @returns {HTMLButtonElement} */
  make(action) {
    const letter = Object.entries(LETTERS).find(([, asked]) => asked === action)?.[0];
    const button = element('button', {
      type: 'button', class: `action ${action}`, 'data-action': action,
      'aria-keyshortcuts': letter, onclick: () => this.press(action),
    }, icon(PICTURES[action] ?? ''), element('span', {}, this._page.t(`teach.${action}`)),
    element('kbd', {class: 'keys', 'aria-hidden': 'true'}, letter ?? ''));
    this._buttons.set(action, button);
    return button;
  }

  /**
   * Do what a button asks for, or say why not.
   *
   * @param {string} asked An action, or `go` for what comes next while showing the way.
   */
  press(asked) {
    const {state} = this._page;
    const action = asked !== 'go' ? asked : RECORDING.includes(state.phase) ? 'keep' : 'start';
    const why = whyNot(action, state);
    if (this._busy) {
      this._page.say(this._page.t('why.busy'));
    } else if (why) {
      this._page.say(this._page.t(`why.${why}`));
    } else {
      void this._act(action);
    }
  }

  /** Show which of them are there now. */
  refresh() {
    const {state} = this._page;
    const next = nextAction(state);
    const isRecording = RECORDING.includes(state.phase);
    let lostFocus = false;
    for (const [action, button] of this._buttons) {
      // One that stands for nothing now would only be in the way; the focus may be on it.
      const isThere = action === 'start' ? !isRecording
        : ['keep', 'redo', 'cancel'].includes(action) ? isRecording
          : action !== 'set_back' || state.simulation;
      lostFocus ||= button === document.activeElement && !isThere;
      button.hidden = !isThere;
      button.setAttribute('aria-disabled', String(Boolean(whyNot(action, state))));
      button.classList.toggle('primary', action === next && !isTrying(state));
    }
    if (lostFocus) {
      this._buttons.get(isRecording ? 'keep' : 'run_trials')?.focus();
    }
  }

  /** @param {string} action */
  async _act(action) {
    const button = this._buttons.get(action);
    this._busy = action;
    button?.setAttribute('aria-busy', 'true');
    this._page.sayAnswer(action, await this._ask(action, this._bodies()[action] ?? {}));
    this._busy = '';
    button?.removeAttribute('aria-busy');
  }

  /** @param {import('../types.js').Answer} answer Whether it was refused for a moment only. */
  _isSoonOver({code}) {
    return code === 'learning' || (
      code === 'trying' && ['finishing', 'learning'].includes(this._page.state.phase));
  }

  /**
   * Ask for an action; while the robot is learning again and again, as long as nobody stops it.
   *
   * @param {string} action
   * @param {object} body
   */
  async _ask(action, body) {
    const path = `/api/actions/${action}`;
    const until = performance.now() + PATIENCE;
    let isStopped = false;
    const off = this._page.next('stopped', () => {
      isStopped = true;
    });
    let answer = await this._page.post(path, body);
    while (this._isSoonOver(answer) && !isStopped && performance.now() < until) {
      await new Promise(done => setTimeout(done, PAUSE));
      answer = isStopped ? answer : await this._page.post(path, body);
    }
    off();
    return answer;
  }
}
