/** What every episode came to, and the fields they led to, as far as they were asked for. */

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Field} Field */
/** @typedef {import('../types.js').Point} Point */
/**
 * @typedef {object} Row
 * @property {string} name
 * @property {number} number Of the bag.
 * @property {'demo' | 'trial'} kind
 * @property {number} steps
 * @property {number} reinforcements
 * @property {number} collisions
 * @property {string} outcome
 * @property {string} stop_reason
 * @property {string} label
 * @property {number} seconds
 * @property {number | null} prototypes After it; null until the next one begins.
 * @property {string | null} field Version of the field after it; null likewise.
 * @property {number} count Which drive or which try of the memory it is, from 1.
 */
/** @typedef {{field: Field | null, way: Point[]}} Shot */

/** What was not read yet is asked for again after this time, [ms]. */
const AGAIN = 300;
/** Fields that are kept in mind. */
const MOST_KEPT = 120;

export class History {
  /** @param {Page} page */
  constructor(page) {
    this._page = page;
    /** @type {Row[]} */
    this.rows = [];
    this.task = '';
    /** Called when episodes have come or gone, or the last field has. */
    this.onChange = () => {};
    /** @type {Map<string, Promise<any>>} */
    this._kept = new Map();
    /** @type {Field | null} */
    this._live = null;
    this._asked = '';
    this._isAsking = false;
    page.on('state', () => this.refresh());
    page.on('room', () => this.refresh(true));
    page.on('connection', () => this.refresh(true));
    page.on('field', field => {
      this._live = field;
      if (page.room === 'story') {
        this.onChange();
      }
    });
  }

  /**
   * Ask for the rows if there may be others, and somebody looks.
   *
   * @param {boolean} [anyway]
   */
  refresh(anyway = false) {
    const {task, episodes, revision} = this._page.state;
    const wanted = JSON.stringify([task, episodes, revision]);
    const isNew = anyway || wanted !== this._asked;
    if (this._page.room === 'story' && task && isNew && !this._isAsking) {
      this._asked = wanted;
      void this._ask(task);
    }
  }

  /** @returns {Row[]} The tries among the rows. */
  get trials() {
    return this.rows.filter(({kind}) => kind === 'trial');
  }

  /**
   * @param {Row} row
   * @returns {number | null} How many prototypes there are after an episode.
   */
  prototypesAfter(row) {
    const {prototypes} = this._page.state;
    return row.prototypes ?? (this._isLast(row) && prototypes >= 0 ? prototypes : null);
  }

  /**
   * Return the field after an episode, and the way of it; without a field where none is known yet.
   *
   * @param {Row} row
   * @returns {Promise<Shot>}
   */
  async shotOf(row) {
    const version = row.field ?? '';
    const frame = await this._frame(
      `/api/story/${this.task}/${row.number}${version && `?v=${version}`}`);
    const way = Array.from(frame.way_x, (x, index) => [x, frame.way_y[index]]);
    const live = this._isLast(row) ? this._live : null;
    return {field: frame.angle ? frame : live, way: /** @type {Point[]} */ (way)};
  }

  /** @param {Row} row @returns {boolean} Whether the live field is what it led to. */
  _isLast(row) {
    return row.field === null && row === this.rows.at(-1) &&
      this._live?.revision === this.rows.length;
  }

  /** @param {string} path */
  _frame(path) {
    const kept = this._kept.get(path) ?? this._page.binary(path);
    this._kept.delete(path); // what was wanted last goes last
    this._kept.set(path, kept);
    kept.catch(() => this._kept.delete(path));
    for (const oldest of this._kept.keys()) {
      if (this._kept.size <= MOST_KEPT) {
        break;
      }
      this._kept.delete(oldest);
    }
    return kept;
  }

  /** @param {string} task */
  async _ask(task) {
    this._isAsking = true;
    try {
      const {episodes, complete} = await this._page.json(
        `/api/story?task=${encodeURIComponent(task)}`);
      this._show(task, episodes);
      if (!complete) {
        setTimeout(() => this.refresh(true), AGAIN);
      }
    } catch {
      this._asked = ''; // the next word of the server is a reason to try again
    }
    this._isAsking = false;
  }

  /** @param {string} task @param {Row[]} rows */
  _show(task, rows) {
    if (task !== this.task) {
      this._kept.clear();
    }
    this.task = task;
    this.rows = rows;
    this.onChange();
  }
}
