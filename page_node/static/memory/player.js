/** A drive that is looked at: map, scrubber, why, and what can be done with it. */

import {element, icon} from '../dom.js';
import {FLAGS} from '../live/field_layer.js';
import {followGestures, makeZoom} from '../live/gestures.js';
import {MapView} from '../live/map_view.js';
import {askFrame, pathOf, wordsFor} from './ask.js';
import {Replay} from './replay.js';
import {damageOf, endOf, titleOf, whenOf} from './row_words.js';
import {Scrubber} from './scrubber.js';
import {Why} from './why.js';
import {directionOf} from './why_words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./ask.js').Row} Row */
/** @typedef {{onBack: () => void, onSource: (episode: number, second: number) => void,
 *   nameOf: (number: number) => string, onChanged: () => void}} Listeners */

/** Of a robot whose size nobody tells, [m]. */
const RADIUS = 0.105;
const HEADINGS = ['E', 'NE', 'N', 'NW', 'W', 'SW', 'S', 'SE'];

export class Player {
  /** @param {Page} page @param {Listeners} listeners */
  constructor(page, listeners) {
    this._page = page;
    this._listeners = listeners;
    /** @type {Row | null} */
    this.row = null;
    /** @type {Replay | null} */
    this._replay = null;
    this._loading = new AbortController();
    /** @type {any} */
    this._field = null;
    this._shownField = -2;
    this._shownUntil = 0;
    this._radius = RADIUS;
    page.on('robot', ({radius}) => {
      this._radius = radius ?? RADIUS;
    });
    this._canvas = element('canvas', {role: 'img', 'aria-label': page.t('memory.map')});
    this._map = new MapView(this._canvas);
    followGestures(this._map);
    this._scrubber = new Scrubber(page, at => this._moveTo(at), () => this._rest());
    this._why = new Why(
      page, listeners.onSource, listeners.nameOf, code => this._refused(code));
    const {t} = page;
    this._title = element('h2', {tabindex: -1});
    this._when = element('p', {class: 'quiet'});
    this._note = element('p', {class: 'note', role: 'status', hidden: true});
    this._buttons = element('div', {class: 'row'});
    this.root = element('article', {class: 'player', hidden: true},
      element('header', {}, element('button', {
        type: 'button', class: 'to-list', onclick: () => this._listeners.onBack(),
      }, icon('M15 5l-7 7 7 7'), t('memory.back')), element('div', {}, this._title, this._when)),
      this._note,
      element('figure', {class: 'live'}, this._canvas, makeZoom(this._map, this._page)),
      this._scrubber.root, this._why.root, this._buttons);
  }

  /**
   * Show a drive from a moment on.
   *
   * @param {Row} row
   * @param {number} [at] [s]
   */
  async open(row, at = 0) {
    this._loading.abort();
    this._loading = new AbortController();
    const {signal} = this._loading;
    this.row = row;
    this._replay = null;
    this.root.hidden = false;
    this._clear();
    this.update(row);
    try {
      this._begin(new Replay(await askFrame(pathOf(row, 'replay'), signal)), at);
    } catch (error) {
      if (!signal.aborted) {
        this._fail(error);
      }
    }
  }

  /** Look at nothing any more. */
  close() {
    this._loading.abort();
    this._scrubber.load(null);
    this._why.clear();
    this.row = null;
    this.root.hidden = true;
  }

  /** Give the focus to what is looked at. */
  focus() {
    this._title.focus();
  }

  /** @param {Row} row Show what is new about it: a label, or how it ended meanwhile. */
  update(row) {
    const before = this.row;
    this.row = row;
    this._title.replaceChildren(titleOf(this._page, row));
    this._when.replaceChildren([whenOf(this._page, row), endOf(this._page, row).text]
      .filter(Boolean).join(' · '));
    this._say(damageOf(this._page, row), row.note ?? '');
    this._offer(row);
    if (this._replay && before?.damage === 'recording' && before.version !== row.version) {
      void this._grow(row, this._loading.signal);
    }
  }

  /** @param {Row} row @param {AbortSignal} signal Load more of what is being recorded. */
  async _grow(row, signal) {
    try {
      const replay = new Replay(await askFrame(pathOf(row, 'replay'), signal));
      if (!this._scrubber.isPlaying) {
        this._begin(replay, this._scrubber.at);
      }
    } catch (error) {
      if (!signal.aborted) {
        this._refused(/** @type {any} */ (error).code ?? '');
      }
    }
  }

  /** Say that it is there no more; what was loaded stays. */
  gone() {
    this._say(this._page.t('memory.refused.gone'), '');
    this._buttons.replaceChildren();
  }

  _clear() {
    this._scrubber.load(null);
    this._why.clear();
    this._shownField = -2;
    this._field = null;
    for (const name of /** @type {const} */ (
      ['field', 'prototypes', 'goal', 'start', 'sight', 'robot', 'decision'])) {
      this._map.show(name, null);
    }
    this._map.showTrail([], '');
    this._scrubber.root.hidden = this._why.root.hidden = true;
  }

  /** @param {Replay} replay @param {number} at */
  _begin(replay, at) {
    this._replay = replay;
    this._shownUntil = Infinity;
    this._scrubber.root.hidden = this._why.root.hidden = false;
    this._map.zoom(0);
    this._scrubber.load(replay, at);
  }

  /** @param {Row} row @param {import('../types.js').Field} field */
  _showGoal({kind}, {flags, cols, resolution, origin}) {
    const cell = flags.findIndex(flag => (flag & FLAGS.goal) > 0);
    const end = this._replay?.poseAt(this._replay.seconds);
    if (cell >= 0) {
      this._map.show('goal', [origin[0] + (cell % cols + 0.5) * resolution,
        origin[1] + (Math.floor(cell / cols) + 0.5) * resolution]);
    } else if (kind === 'demo' && end) {
      this._map.show('goal', [end.x, end.y]);
    }
  }

  /** @param {number} at Show a moment, [s]. */
  _moveTo(at) {
    const replay = this._replay;
    if (!replay) {
      return;
    }
    const pose = replay.poseAt(at);
    this._map.show('robot', {...pose, radius: this._radius});
    this._scrubber.tell(Number.isFinite(pose.v)
      ? this._page.t('memory.driving', {speed: Math.round(Math.abs(pose.v) * 100) / 100}) : '');
    this._map.show('sight', replay.sightAt(at));
    this._showDecision(replay, at);
    this._showWay(replay, at);
    this._showField(replay.fieldAt(at), at);
    this._canvas.setAttribute('aria-label', this._describe(replay, at));
    if (this._scrubber.isPlaying) {
      this._why.clear();
    }
  }

  /** @param {Replay} replay @param {number} at */
  _showDecision(replay, at) {
    const decision = replay.decisionAt(at);
    const grid = this._field;
    this._map.show('decision', decision && grid ? {
      row: Math.floor((decision.y - grid.origin[1]) / grid.resolution),
      col: Math.floor((decision.x - grid.origin[0]) / grid.resolution),
      heading: decision.heading} : null);
  }

  /** @param {Replay} replay @param {number} at */
  _showWay(replay, at) {
    if (at >= this._shownUntil) {
      this._map.showTrail(replay.way(this._shownUntil, at));
    } else {
      this._map.showTrail([replay.first, ...replay.way(-1, at)], this.row?.kind ?? '');
    }
    this._shownUntil = at;
  }

  /** @param {number} index Of the field in force. @param {number} at */
  _showField(index, at) {
    if (index === this._shownField || !this.row) {
      return;
    }
    this._shownField = index;
    void this._loadField(this.row, at, this._loading.signal);
  }

  /** @param {Row} row @param {number} at @param {AbortSignal} signal */
  async _loadField(row, at, signal) {
    try {
      const [field, prototypes] = /** @type {any[]} */ (await Promise.all(
        ['field', 'prototypes'].map(what => askFrame(pathOf(row, what, at), signal))));
      this._field = field;
      this._map.show('field', field);
      this._map.show('prototypes', prototypes);
      this._showGoal(row, field);
      if (this._replay) {
        this._showDecision(this._replay, this._scrubber.at);
      }
    } catch (error) {
      if (!signal.aborted) {
        this._refused(/** @type {any} */ (error).code ?? '');
      }
    }
  }

  _rest() {
    if (this.row && this._replay) {
      this._why.ask(this.row, this._scrubber.at);
    }
  }

  /** @param {Replay} replay @param {number} at @returns {string} */
  _describe(replay, at) {
    const {t} = this._page;
    const {x, y} = replay.poseAt(at);
    const decision = replay.decisionAt(at);
    const said = [t('memory.map'), t('live.robot_at', {x: tenth(x), y: tenth(y)})];
    if (decision) {
      said.push(t('memory.heads', {
        where: directionOf(this._page, HEADINGS[decision.heading] ?? '-')}));
    }
    return said.join(' ');
  }

  /** @param {unknown} error */
  _fail(error) {
    const {text, details} = wordsFor(this._page, error);
    this._say(text, details);
    this._refused(/** @type {any} */ (error).code ?? '');
  }

  /** @param {string} code */
  _refused(code) {
    if (code === 'gone') {
      this.gone();
      this._listeners.onChanged();
    }
  }

  /** @param {string} text @param {string} details In the memory's own words. */
  _say(text, details) {
    this._note.hidden = !text;
    this._note.replaceChildren(text, text && details ? element('details', {},
      element('summary', {}, this._page.t('page.details')), details) : '');
  }

  /** @param {Row} row Offer what can be done with it. */
  _offer(row) {
    if (row.forgotten || row.state === 'recording') {
      this._buttons.replaceChildren();
      return;
    }
    const episode = `${String(row.number).padStart(4, '0')}_${row.kind}`;
    const offers = [['label_success', 'memory.well'], ['label_failure', 'memory.badly'],
      ['forget', 'memory.remove']];
    this._buttons.replaceChildren(...offers.map(([action = '', words = '']) => element('button', {
      type: 'button', 'data-memory': action, onclick: async () => {
        await this._page.act(action, {episode});
        this._listeners.onChanged();
      },
    }, this._page.t(words))));
  }
}

/** @param {number} metres */
function tenth(metres) {
  return Math.round(metres * 10) / 10;
}
