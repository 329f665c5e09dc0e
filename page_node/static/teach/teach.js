/** The room to teach in: the map, and three steps beside it. */

import {element} from '../dom.js';
import {mount as mountLive} from '../live/live.js';
import {mountTask} from '../worlds/task_choice.js';
import {Buttons, RECORDING} from './buttons.js';
import {mountGamepadHelp} from './gamepad_help.js';
import {trialWords} from './words.js';

/** @typedef {import('../page.js').Page} Page */

/** How many trials are offered, one after the other; a real robot is driven back in between. */
const SERIES = [1, 5, 20];

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  const live = element('figure', {class: 'live'});
  const buttons = new Buttons(page, () => ({run_trials: {n: chosenSeries(root)}}));
  const steps = element('div', {class: 'steps'},
    showStep(page, buttons), tryStep(page, buttons), judgeStep(page, buttons));
  root.append(live, steps);
  mountLive(live, page);
  mountTask(live, page);
  mountGamepadHelp(steps, page);
  page.on('state', ({phase}) => {
    steps.classList.toggle('recording', RECORDING.includes(phase));
    buttons.refresh();
  });
  buttons.refresh();
  page.next('asked', ({action}) => buttons.press(action));
}

/**
 * @param {Page} page
 * @param {string} name
 * @param {...import('../dom.js').Child} children
 */
function step(page, name, ...children) {
  const title = `step-${name}`;
  return element('section', {class: `card step ${name}`, 'aria-labelledby': title},
    element('h2', {id: title}, page.t(`teach.${name}`)), ...children);
}

/** @param {Page} page @param {Buttons} buttons */
function showStep(page, buttons) {
  const recording = element('p', {class: 'watching', hidden: true});
  page.on('state', ({phase, seconds}) => {
    recording.hidden = phase !== 'demonstration';
    recording.textContent = page.t('teach.recording', {seconds: Math.floor(seconds)});
  });
  return step(page, 'show', recording, element('div', {class: 'row'},
    ...['start', 'keep', 'redo', 'cancel'].map(action => buttons.make(action))));
}

/** @param {Page} page @param {Buttons} buttons */
function tryStep(page, buttons) {
  const left = element('p', {class: 'left', hidden: true});
  page.on('state', ({trial, trials_left: running, tries_left: waiting}) => {
    // The one under way is counted with those that the learner runs.
    const underWay = ['running', 'paused'].includes(trial.state) ? 1 : 0;
    const n = Math.max(running - underWay, 0) || waiting;
    left.hidden = n < 1;
    left.textContent = page.t('teach.left', {n});
  });
  return step(page, 'try', left, element('div', {class: 'row'},
    buttons.make('run_trials'), seriesChoice(page)));
}

/** @param {Page} page @param {Buttons} buttons */
function judgeStep(page, buttons) {
  const told = element('p', {class: 'told'});
  page.on('state', ({trial}) => {
    const words = trialWords(page, trial);
    if (told.textContent !== words) {
      told.textContent = words;
    }
    told.dataset.outcome = trial.state === 'ended' ? trial.outcome : '';
  });
  const row = /** @param {string} kind @param {string[]} actions */ (kind, ...actions) => (
    element('div', {class: kind}, ...actions.map(action => buttons.make(action))));
  return step(page, 'judge', told, row('row', 'label_success', 'label_failure'),
    row('row small', 'drop_last', 'undo', 'set_back'));
}

/** @param {Page} page How many trials, one after the other. */
function seriesChoice(page) {
  return element('fieldset', {class: 'series'},
    element('legend', {class: 'unseen'}, page.t('teach.series')),
    ...SERIES.map((n, index) => element('label', {},
      element('input', {type: 'radio', name: 'series', value: n, checked: index === 0}),
      element('span', {}, page.t('teach.times', {n})))));
}

/** @param {HTMLElement} root @returns {number} */
function chosenSeries(root) {
  const chosen = root.querySelector('input[name=series]:checked');
  return chosen instanceof HTMLInputElement ? Number(chosen.value) : 1;
}
