/** The answer to “why?” beside a drive: a sentence, who had a say, and numbers to unfold. */

import {element} from '../dom.js';
import {askJson, pathOf, wordsFor} from './ask.js';
import {mainSentence, moreSentences, voicesOf} from './why_words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./ask.js').Row} Row */
/** @typedef {import('./why_words.js').About} About */

/** Whoever scrubs is asked for nothing until they rest so long, [ms]. */
const REST = 200;
/** So many of those who had a say are shown at once. */
const MOST = 5;

export class Why {
  /**
   * @param {Page} page
   * @param {(episode: number, second: number) => void} onSource Shows where a prototype is from.
   * @param {(number: number) => string} nameOf Names a drive or a trial.
   * @param {(code: string) => void} onRefused
   */
  constructor(page, onSource, nameOf, onRefused) {
    this._page = page;
    this._onSource = onSource;
    this._nameOf = nameOf;
    this._onRefused = onRefused;
    this._timer = 0;
    this._asking = new AbortController();
    this._sentence = element('p', {class: 'sentence'});
    this._more = element('div', {class: 'more'});
    this.root = element('section', {class: 'card why', 'aria-labelledby': 'why-title'},
      element('h3', {id: 'why-title'}, page.t('memory.why')),
      element('div', {'aria-live': 'polite'}, this._sentence), this._more);
  }

  /** Say nothing, and want no answer any more. */
  clear() {
    clearTimeout(this._timer);
    this._asking.abort();
    this._sentence.textContent = '';
    this._more.replaceChildren();
    this.root.removeAttribute('aria-busy');
  }

  /** @param {Row} row @param {number} at Ask soon, unless it is asked for another moment. */
  ask(row, at) {
    clearTimeout(this._timer);
    this._asking.abort();
    this._asking = new AbortController();
    const {signal} = this._asking;
    this.root.setAttribute('aria-busy', 'true');
    this._timer = window.setTimeout(() => void this._ask(row, at, signal), REST);
  }

  /** @param {Row} row @param {number} at @param {AbortSignal} signal */
  async _ask(row, at, signal) {
    try {
      const about = await askJson(pathOf(row, 'why', at), signal);
      this._show(about);
    } catch (error) {
      if (signal.aborted) {
        return;
      }
      const {text, details} = wordsFor(this._page, error);
      this._sentence.textContent = text;
      this._more.replaceChildren(...(details ? [this._details([details])] : []));
      this._onRefused(/** @type {any} */ (error).code ?? '');
    }
    this.root.removeAttribute('aria-busy');
  }

  /** @param {About} about */
  _show(about) {
    this._sentence.textContent = mainSentence(this._page, about);
    const voices = voicesOf(this._page, about, this._nameOf);
    const lines = voices.map(({share, text, voice}) => element('li', {},
      element('span', {class: 'share'}, share), voice && voice.episode > 0 && voice.second !== null
        ? this._link(text, voice.episode, voice.second) : element('span', {}, text)));
    this._more.replaceChildren(
      ...moreSentences(this._page, about).map(text => element('p', {}, text)),
      ...(lines.length ? [element('h4', {}, this._page.t('memory.why.comes_from')),
        element('ul', {class: 'voices'}, ...lines.slice(0, MOST))] : []),
      ...(lines.length > MOST ? [element('details', {},
        element('summary', {}, this._page.t('memory.why.others', {n: lines.length - MOST})),
        element('ul', {class: 'voices'}, ...lines.slice(MOST)))] : []),
      this._details(numbersOf(this._page, about)));
  }

  /** @param {string} text @param {number} episode @param {number} second */
  _link(text, episode, second) {
    return element('button', {
      type: 'button', class: 'source', onclick: () => this._onSource(episode, second)}, text);
  }

  /** @param {string[]} lines */
  _details(lines) {
    return element('details', {}, element('summary', {}, this._page.t('page.details')),
      ...lines.map(line => element('p', {class: 'quiet'}, line)));
  }
}

/** @param {Page} page @param {About} about @returns {string[]} For who wants to know exactly. */
function numbersOf(page, {pose, command, course, trial, no_course: missing}) {
  const number = /** @param {number | null} value */ value => (
    value === null ? '–' : page.words.number(value, 3));
  const velocity = /** @param {(number | null)[]} pair */ ([v, w]) => page.t(
    'memory.numbers.velocity', {v: number(v ?? null), w: number(w ?? null)});
  return [
    page.t('memory.numbers.pose', {x: number(pose[0]), y: number(pose[1]),
      degrees: Math.round(pose[2] * 180 / Math.PI)}),
    command.requested && page.t('memory.numbers.asked', {velocity: velocity(command.requested)}),
    command.applied && page.t('memory.numbers.applied', {velocity: velocity(command.applied)}),
    course && page.t('memory.numbers.field', {
      revision: String(course.revision), coherence: number(course.coherence)}),
    trial?.reason, missing].filter(Boolean);
}
