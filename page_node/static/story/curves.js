/** The paper's figures 5 to 7: a number of every try, in one small picture each. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./history.js').Row} Row */
/** @typedef {import('./history.js').History} History */
/** @typedef {{x: number, y: number, row: Row | null}} Mark */
/** @typedef {{width: number, height: number, em: number}} Size [px] */

/** What is shown of a try, and the number of the paper's figure. */
const CURVES = /** @type {const} */ ([
  ['steps', 5], ['prototypes', 6], ['reinforcements', 7]]);
/** Around what is drawn: room for numbers, in heights of a line. */
const [LEFT, RIGHT, TOP, BOTTOM] = [2.6, 0.8, 0.7, 1.5];
/** Lines across, and numbers along the axis below, at most. */
const [MOST_LINES, MOST_TICKS] = [4, 10];
/** How far off a mark may be pressed, [px]. */
const NEAR = 22;
const SVG = 'http://www.w3.org/2000/svg';

/** @typedef {(typeof CURVES)[number][0]} Quantity */

export class Curves {
  /**
   * @param {HTMLElement} root
   * @param {Page} page
   * @param {History} history
   * @param {(row: Row) => void} choose
   */
  constructor(root, page, history, choose) {
    this._page = page;
    this._history = history;
    /** @type {Row | null} */
    this._chosen = null;
    this._curves = CURVES.map(([quantity, figure]) => {
      const svg = drawing('svg', {'aria-hidden': 'true'});
      const now = element('strong');
      root.append(element('figure', {class: 'card curve'},
        element('figcaption', {}, element('span', {}, page.t(`story.${quantity}`)), now,
          element('small', {}, page.t('story.figure', {n: figure}))), svg));
      const curve = {quantity, svg, now, marks: /** @type {Mark[]} */ ([])};
      svg.addEventListener('click', event => {
        const row = nearest(curve.marks, /** @type {MouseEvent} */ (event).offsetX);
        row && choose(row);
      });
      new ResizeObserver(() => this.draw()).observe(svg);
      return curve;
    });
    page.on('state', () => page.room === 'story' && this.draw());
  }

  /** @param {Row | null} row Mark it. */
  choose(row) {
    this._chosen = row;
    this.draw();
  }

  /** Draw what is known now. */
  draw() {
    for (const curve of this._curves) {
      this._draw(curve, sizeOf(curve.svg));
    }
  }

  /**
   * @param {{quantity: Quantity, svg: SVGElement, now: HTMLElement, marks: Mark[]}} curve
   * @param {Size} size
   */
  _draw(curve, size) {
    const [trials, running] = [this._history.trials, this._running()];
    const values = trials.map(row => this._value(row, curve.quantity));
    const now = running && curve.quantity !== 'prototypes' ? running[curve.quantity] : null;
    const axes = new Axes(size, Math.max(trials.length + (running ? 1 : 0), MOST_LINES),
      Math.max(...values.map(value => value ?? 0), now ?? 0));
    curve.marks = trials.map((row, index) => (
      {x: axes.x(index + 1), y: axes.y(values[index] ?? 0), row}));
    const known = curve.marks.filter((_, index) => values[index] !== null);
    const live = now === null ? [] : [{x: axes.x(trials.length + 1), y: axes.y(now), row: null}];
    curve.svg.replaceChildren(
      ...axes.lines(this._page), ...chosenLine(known, this._chosen, axes),
      line([...known, ...live]), ...known.map(mark => symbol(mark, this._chosen)),
      ...live.map(hollow));
    const last = now ?? values.findLast(value => value !== null);
    curve.now.textContent = last === undefined ? '' : this._page.words.number(last ?? 0);
  }

  /** @returns {{steps: number, reinforcements: number} | null} Of the try under way. */
  _running() {
    const {phase, trial} = this._page.state;
    return phase === 'trial' && ['running', 'paused'].includes(trial.state) ? trial : null;
  }

  /** @param {Row} row @param {Quantity} quantity @returns {number | null} */
  _value(row, quantity) {
    return quantity === 'prototypes' ? this._history.prototypesAfter(row) : row[quantity];
  }
}

/** Where a number of a try is in the picture. */
class Axes {
  /** @param {Size} size @param {number} nTrials @param {number} most */
  constructor({width, height, em}, nTrials, most) {
    this._nTrials = nTrials;
    this._step = stepFor(most);
    this._most = Math.max(1, Math.ceil(most / this._step)) * this._step;
    this._em = em;
    this._left = LEFT * em;
    this._right = width - RIGHT * em;
    this.top = TOP * em;
    this.bottom = height - BOTTOM * em;
  }

  /** @param {number} trial @returns {number} */
  x(trial) {
    return this._left + (trial - 0.5) / this._nTrials * (this._right - this._left);
  }

  /** @param {number} value @returns {number} */
  y(value) {
    return this.bottom - value / this._most * (this.bottom - this.top);
  }

  /** @param {Page} page @returns {SVGElement[]} Lines and numbers. */
  lines(page) {
    const made = [];
    for (let value = 0; value <= this._most; value += this._step) {
      const y = this.y(value);
      made.push(
        drawing('line', {x1: this._left, x2: this._right, y1: y, y2: y, class: 'grid'}),
        text(this._left - 0.5 * this._em, y + 0.35 * this._em, page.words.number(value), 'end'));
    }
    const every = Math.ceil(this._nTrials / MOST_TICKS);
    for (let trial = 1; trial <= this._nTrials; trial += every) {
      made.push(text(this.x(trial), this.bottom + 1.2 * this._em, page.words.number(trial),
        'middle'));
    }
    return made;
  }
}

/** @param {SVGElement} svg @returns {Size} */
function sizeOf(svg) {
  const {width, height} = svg.getBoundingClientRect();
  return {width, height, em: parseFloat(getComputedStyle(svg).fontSize)};
}

/** @param {number} most @returns {number} What lies between two lines: 1, 2 or 5, and noughts. */
function stepFor(most) {
  const power = 10 ** Math.floor(Math.log10(Math.max(most, 1)));
  return Math.max(1, [0.2, 0.5, 1, 2].map(part => part * power).find(
    step => most / step <= MOST_LINES) ?? power);
}

/** @param {Mark[]} marks @returns {SVGElement} */
function line(marks) {
  return drawing('polyline', {
    points: marks.map(({x, y}) => `${x},${y}`).join(' '), class: 'line'});
}

/** @param {Mark[]} marks @param {Row | null} chosen @param {Axes} axes @returns {SVGElement[]} */
function chosenLine(marks, chosen, {top, bottom}) {
  const mark = marks.find(({row}) => row?.number === chosen?.number);
  return mark ? [drawing('line', {
    x1: mark.x, x2: mark.x, y1: top, y2: bottom, class: 'chosen'})] : [];
}

/** @param {Mark} mark @param {Row | null} chosen @returns {SVGElement} A cross where it failed. */
function symbol({x, y, row}, chosen) {
  const size = row?.number === chosen?.number ? 6 : 4.5;
  return row?.outcome === 'goal' ?
    drawing('circle', {cx: x, cy: y, r: size, class: 'mark'}) :
    drawing('path', {class: 'mark failed', d: `M${x - size} ${y - size}l${2 * size} ${2 * size}` +
      `M${x - size} ${y + size}l${2 * size} ${-2 * size}`});
}

/** @param {Mark} mark @returns {SVGElement} The try under way. */
function hollow({x, y}) {
  return drawing('circle', {cx: x, cy: y, r: 4.5, class: 'mark running'});
}

/** @param {Mark[]} marks @param {number} at @returns {Row | null} */
function nearest(marks, at) {
  const found = [...marks].sort((a, b) => Math.abs(a.x - at) - Math.abs(b.x - at))[0];
  return found && Math.abs(found.x - at) < NEAR ? found.row : null;
}

/**
 * @param {number} x
 * @param {number} y
 * @param {string} words
 * @param {string} anchor
 */
function text(x, y, words, anchor) {
  const made = drawing('text', {x, y, 'text-anchor': anchor});
  made.textContent = words;
  return made;
}

/** @param {string} tag @param {Record<string, string | number>} attributes */
function drawing(tag, attributes) {
  const made = /** @type {SVGElement} */ (document.createElementNS(SVG, tag));
  for (const [name, value] of Object.entries(attributes)) {
    made.setAttribute(name, String(value));
  }
  return made;
}
