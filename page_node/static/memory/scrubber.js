/** Goes through a drive: a slider with marks, play, steps, and how fast. */

import {element, icon} from '../dom.js';
import {KINDS} from './replay.js';
import {secondsText} from './row_words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./replay.js').Replay} Replay */

const PLAY = 'M7 5v14l12-7z';
const PAUSE = 'M8 5v14M16 5v14';
const SPEEDS = [0.25, 0.5, 1, 2, 5, 10];
/** Steps of the slider, [s]. */
const STEP = 0.05;
/** Width of the marks in their own unit, and of a single one. */
const WIDE = 1000;
const MARK = 2.5;

export class Scrubber {
  /**
   * @param {Page} page
   * @param {(at: number) => void} onMoved Called for every moment that is to be shown, [s].
   * @param {() => void} onRest Called when it stands.
   */
  constructor(page, onMoved, onRest) {
    this._page = page;
    this._onMoved = onMoved;
    this._onRest = onRest;
    this.at = 0;
    /** @type {Replay | null} */
    this._replay = null;
    this._frame = 0;
    this._slider = element('input', {
      type: 'range', min: 0, step: STEP, class: 'moment', 'aria-label': page.t('memory.moment'),
      oninput: () => this.go(Number(this._slider.value)), onchange: () => this._rest()});
    this._time = element('output', {class: 'time'});
    this._play = button(page, 'play', PLAY, () => this.isPlaying ? this.pause() : this.play());
    this._speed = this._speedChoice();
    this._marks = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    this._marks.setAttribute('viewBox', `0 0 ${WIDE} 10`);
    this._marks.setAttribute('preserveAspectRatio', 'none');
    this._marks.setAttribute('aria-hidden', 'true');
    this.root = element('div', {class: 'scrubber'},
      element('div', {class: 'track'}, this._marks, this._slider),
      element('div', {class: 'row'},
        button(page, 'before', 'M18 6l-8 6 8 6zM6 6v12', () => this._step(-1)), this._play,
        button(page, 'after', 'M6 6l8 6-8 6zM18 6v12', () => this._step(1)),
        this._time, this._speed));
  }

  /** @returns {boolean} */
  get isPlaying() {
    return this._frame !== 0;
  }

  /** @param {Replay | null} replay @param {number} [at] [s] */
  load(replay, at = 0) {
    this.pause();
    this._replay = replay;
    const seconds = replay?.seconds ?? 0;
    this._slider.max = (Math.ceil(seconds / STEP) * STEP).toFixed(2);
    this._marks.replaceChildren(...(replay ? marksOf(replay) : []));
    if (replay) {
      this.go(at);
      this._rest();
    }
  }

  /** @param {number} at Show a moment, [s]. */
  go(at) {
    const seconds = this._replay?.seconds ?? 0;
    this.at = Math.min(Math.max(at, 0), seconds);
    this._slider.value = String(this.at);
    this._slider.setAttribute('aria-valuetext', secondsText(this._page, this.at));
    this._onMoved(this.at);
  }

  /** @param {string} text What is so at this moment. */
  tell(text) {
    const times = [this.at, this._replay?.seconds ?? 0].map(
      seconds => secondsText(this._page, seconds));
    this._time.textContent = [times.join(' / '), text].filter(Boolean).join(' · ');
  }

  /** Let time pass. */
  play() {
    if (!this._replay) {
      return;
    }
    if (this.at >= this._replay.seconds - STEP) {
      this.go(0);
    }
    let last = performance.now();
    const pass = /** @param {number} now */ now => {
      this.go(this.at + (now - last) / 1000 * Number(this._speed.value));
      last = now;
      if (this._replay && this.at < this._replay.seconds) {
        this._frame = requestAnimationFrame(pass);
      } else {
        this.pause();
      }
    };
    this._frame = requestAnimationFrame(pass);
    this._show();
  }

  /** Stand. */
  pause() {
    if (this._frame) {
      cancelAnimationFrame(this._frame);
      this._frame = 0;
      this._rest();
    }
    this._show();
  }

  _rest() {
    if (!this.isPlaying) {
      this._onRest();
    }
  }

  /** @param {1 | -1} direction Go to the next decision, or a second on where there is none. */
  _step(direction) {
    this.pause();
    const replay = this._replay;
    if (replay) {
      this.go(replay.decisions.length ? replay.nextDecision(this.at, direction)
        : this.at + direction);
      this._rest();
    }
  }

  _show() {
    const name = this.isPlaying ? 'pause' : 'play';
    this._play.setAttribute('aria-label', this._page.t(`memory.${name}`));
    this._play.replaceChildren(icon(this.isPlaying ? PAUSE : PLAY));
  }

  _speedChoice() {
    const choice = element('select', {'aria-label': this._page.t('memory.speed')},
      ...SPEEDS.map(speed => element('option', {value: speed, selected: speed === 1},
        `${this._page.words.number(speed, 2)} ×`)));
    return choice;
  }
}

/**
 * @param {Page} page
 * @param {string} name
 * @param {string} picture
 * @param {() => void} onclick
 */
function button(page, name, picture, onclick) {
  return element('button', {type: 'button', class: name, 'aria-label': page.t(`memory.${name}`),
    onclick}, icon(picture));
}

/**
 * Return what is marked beside the slider: what was decided otherwise than learnt, who drove,
 * where it waited, and where nothing was recorded.
 *
 * @param {Replay} replay
 * @returns {SVGElement[]}
 */
function marksOf({decisions, statuses, holes, seconds}) {
  const scale = WIDE / Math.max(seconds, STEP);
  const found = decisions.filter(({kind}) => kind > 0).map(({at, kind}) => mark(
    KINDS[kind] ?? '', at * scale - MARK / 2, MARK));
  statuses.forEach(({state, at}, index) => {
    if (state === 'paused') {
      const end = statuses[index + 1]?.at ?? seconds;
      found.unshift(mark('paused', at * scale, (end - at) * scale));
    }
  });
  return [...holes.map(([from, to]) => mark('hole', from * scale, (to - from) * scale)), ...found];
}

/** @param {string} name @param {number} x @param {number} width @returns {SVGElement} */
function mark(name, x, width) {
  const rect = document.createElementNS('http://www.w3.org/2000/svg', 'rect');
  rect.setAttribute('class', `mark ${name}`);
  rect.setAttribute('x', x.toFixed(2));
  rect.setAttribute('width', Math.max(width, MARK).toFixed(2));
  rect.setAttribute('height', '10');
  return rect;
}
