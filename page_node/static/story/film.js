/** The history of the field as a film: a strip of small pictures, and one of them large. */

import {element, icon} from '../dom.js';
import {onColours} from '../live/colours.js';
import {MapView} from '../live/map_view.js';
import {changesBetween, goalOf, KINDS, shareHome} from './changes.js';
import {paintSmall, pictureOfChanges} from './pictures.js';
import {endOf, titleOf} from './words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Field} Field */
/** @typedef {import('./changes.js').Changes} Changes */
/** @typedef {import('./history.js').History} History */
/** @typedef {import('./history.js').Row} Row */
/** @typedef {{label: HTMLLabelElement, input: HTMLInputElement, canvas: HTMLCanvasElement,
 *   key: string}} Small */

/** How long each picture is seen when the film runs, [ms]. */
const PACE = 1000;
/** Side of a small picture, [px]. */
const SIDE = 192;
const ICONS = {
  play: 'M8 5l11 7-11 7z', pause: 'M8 5v14M16 5v14', back: 'M15 5l-7 7 7 7', on: 'M9 5l7 7-7 7',
};

export class Film {
  /**
   * @param {HTMLElement} root
   * @param {Page} page
   * @param {History} history
   * @param {(row: Row) => void} onChosen
   */
  constructor(root, page, history, onChosen) {
    this._page = page;
    this._history = history;
    this._onChosen = onChosen;
    /** @type {Row | null} */
    this.chosen = null;
    this._timer = 0;
    /** @type {Map<number, Small>} By the number of the bag. */
    this._small = new Map();
    this._canvas = element('canvas', {role: 'img', 'aria-label': page.t('story.picture')});
    this._view = new MapView(this._canvas);
    this._words = element('figcaption', {'aria-live': 'polite'});
    this._signs = element('ul', {class: 'changes'});
    this._playing = this._button('play', () => (this._timer ? this.stop() : this._play()));
    this._strip = element('div', {class: 'pictures'});
    this._watch = new IntersectionObserver(
      entries => entries.filter(({isIntersecting}) => isIntersecting).forEach(
        ({target}) => this._paint(Number(/** @type {HTMLElement} */ (target).dataset.number))),
      {root: this._strip, rootMargin: '0px 200px'});
    this._build(root);
    onColours(() => this.update(true));
  }

  /**
   * Show the rows there are; who looks at the last one sees the new one.
   *
   * @param {boolean} [anew] Paint all of them again.
   */
  update(anew = false) {
    const {rows} = this._history;
    const wasLast = !this.chosen || this.chosen.number === [...this._small.keys()].at(-1);
    const wanted = new Set(rows.map(({number}) => number));
    for (const [number, {label}] of this._small) {
      if (anew || !wanted.has(number)) {
        this._watch.unobserve(label);
        label.remove();
        this._small.delete(number);
      }
    }
    rows.forEach((row, index) => {
      const small = this._small.get(row.number) ?? this._makeSmall(row);
      if (this._strip.children[index] !== small.label) {
        this._strip.insertBefore(small.label, this._strip.children[index] ?? null);
      }
      void this._paint(row.number);
    });
    const chosen = rows.find(({number}) => number === this.chosen?.number);
    this.choose((wasLast ? undefined : chosen) ?? rows.at(-1) ?? null, wasLast);
  }

  /**
   * @param {Row | null} row Show it large.
   * @param {boolean} [reveal] Whether the strip moves there.
   */
  choose(row, reveal = true) {
    this.chosen = row;
    const small = row && this._small.get(row.number);
    if (!row || !small) {
      return;
    }
    small.input.checked = true;
    if (reveal) {
      const {offsetLeft, offsetWidth} = small.label;
      this._strip.scrollTo({left: offsetLeft - (this._strip.clientWidth - offsetWidth) / 2});
    }
    this._onChosen(row);
    void this._showLarge(row);
  }

  /** @param {HTMLElement} root */
  _build(root) {
    root.append(
      element('figure', {class: 'shot'},
        element('div', {class: 'shot-map'}, this._canvas),
        element('div', {class: 'shot-words'}, this._words, this._signs),
        element('div', {class: 'row reel'}, this._button('back', () => this._step(-1)),
          this._playing, this._button('on', () => this._step(1)))),
      element('fieldset', {class: 'strip'},
        element('legend', {class: 'unseen'}, this._page.t('story.film')), this._strip));
    this._strip.addEventListener('change', event => {
      this.stop();
      const number = Number(/** @type {HTMLInputElement} */ (event.target).value);
      this.choose(this._history.rows.find(row => row.number === number) ?? null);
    });
  }

  /** @param {'back' | 'play' | 'on'} name @param {() => void} onclick */
  _button(name, onclick) {
    return element('button', {
      type: 'button', 'aria-label': this._page.t(`story.${name}`), onclick}, icon(ICONS[name]));
  }

  /** @param {Row} row @returns {Small} */
  _makeSmall(row) {
    const canvas = element('canvas', {width: SIDE, height: SIDE});
    const input = element('input', {type: 'radio', name: 'shot', value: row.number});
    const title = titleOf(this._page, row);
    const label = element('label', {'data-number': row.number, 'data-outcome': row.outcome},
      input, canvas, element('span', {}, title,
        element('span', {class: 'unseen'}, ` ${endOf(this._page, row)}`)));
    const small = {label, input, canvas, key: ''};
    this._small.set(row.number, small);
    this._watch.observe(label);
    return small;
  }

  /** @param {number} number Paint the small picture of a bag, if it is not what it should be. */
  async _paint(number) {
    const small = this._small.get(number);
    const row = this._history.rows.find(each => each.number === number);
    if (!small || !row || !isNear(small.label, this._strip)) {
      return;
    }
    const seen = await this._seen(row);
    const key = `${seen?.revision} ${seen?.field?.rows} ${row.field}`;
    if (seen?.field && seen.changes && small.key !== key) {
      small.key = key;
      paintSmall(
        small.canvas, seen.field, seen.changes, seen.way, row.kind, this._view.colours);
    }
  }

  /**
   * Return what is seen of an episode; null if that cannot be had now.
   *
   * @param {Row} row
   */
  async _seen(row) {
    const {rows} = this._history;
    const before = rows[rows.indexOf(row) - 1];
    try {
      const [shot, last] = await Promise.all([
        this._history.shotOf(row), before && this._history.shotOf(before)]);
      const {field} = shot;
      return {...shot, revision: field?.revision ?? -1,
        changes: field && changesBetween(last?.field ?? null, field)};
    } catch {
      return null;
    }
  }

  /** @param {Row} row */
  async _showLarge(row) {
    const seen = await this._seen(row);
    if (row !== this.chosen) {
      return;
    }
    const {field = null, changes = null, way = []} = seen ?? {};
    this._view.show('field', field);
    this._view.show('overlay', field && changes && {
      ...field, picture: pictureOfChanges(field, changes, this._view.colours)});
    this._view.show('goal', field && goalOf(field));
    this._view.showTrail(way, row.kind);
    this._say(row, field, changes);
  }

  /** @param {Row} row @param {Field | null} field @param {Changes | null} changes */
  _say(row, field, changes) {
    const {t, words} = this._page;
    const share = field ? shareHome(field) : NaN;
    const said = [`${titleOf(this._page, row)}: ${endOf(this._page, row)}`,
      Number.isNaN(share) ? t('story.soon') : t('story.places', {share: words.share(share)})];
    this._words.replaceChildren(element('strong', {}, said[0] ?? ''), ` ${said[1]}`);
    const found = KINDS.filter(kind => changes?.counts[kind]);
    const signs = found.map(kind => element('li', {class: `change ${kind}`},
      element('span', {class: 'swatch', 'aria-hidden': 'true'}),
      t(`story.${kind}`, {n: changes?.counts[kind] ?? 0})));
    this._signs.replaceChildren(...signs, ...(changes && !found.length ?
      [element('li', {}, t('story.nothing'))] : []));
    this._canvas.setAttribute('aria-label', [t('story.picture'), ...said,
      ...signs.map(sign => sign.textContent)].join(' '));
  }

  /** @param {number} by How many pictures on. @returns {boolean} Whether there was one. */
  _step(by) {
    const {rows} = this._history;
    const at = rows.findIndex(({number}) => number === this.chosen?.number);
    const row = rows[at + by];
    if (row) {
      this.choose(row);
    }
    return Boolean(row);
  }

  /** Show one after the other, from the first on where the last is shown. */
  _play() {
    const {rows} = this._history;
    if (this.chosen === rows.at(-1)) {
      this.choose(rows[0] ?? null);
    }
    this._setPlaying(window.setInterval(() => this._step(1) || this.stop(), PACE));
  }

  /** Stand still. */
  stop() {
    clearInterval(this._timer);
    this._setPlaying(0);
  }

  /** @param {number} timer */
  _setPlaying(timer) {
    this._timer = timer;
    this._playing.setAttribute('aria-label', this._page.t(timer ? 'story.pause' : 'story.play'));
    this._playing.replaceChildren(icon(ICONS[timer ? 'pause' : 'play']));
  }
}

/** @param {HTMLElement} label @param {HTMLElement} strip @returns {boolean} */
function isNear({offsetLeft, offsetWidth}, {scrollLeft, clientWidth}) {
  return offsetLeft + offsetWidth > scrollLeft - clientWidth &&
    offsetLeft < scrollLeft + 2 * clientWidth;
}
