/** The room of what the robot remembers: a list, and the drive that is looked at. */

import {element} from '../dom.js';
import {askJson, wordsFor} from './ask.js';
import {List} from './list.js';
import {Player} from './player.js';
import {titleOf} from './row_words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./ask.js').Row} Row */
/** @typedef {import('./ask.js').Rows} Rows */

/** Wait before a list is asked for that is not complete, or may have changed, [ms]. */
const SOON = 150;
/** How often a bag that is being recorded is looked at, [ms]. */
const OFTEN = 3000;

class Room {
  /** @param {HTMLElement} root @param {Page} page */
  constructor(root, page) {
    this._root = root;
    this._page = page;
    /** @type {Row[]} */
    this._rows = [];
    this._task = '';
    this._key = '';
    this._timer = 0;
    this._n = 0;
    this._list = new List(page, row => this._open(row));
    this._player = new Player(page, {
      onBack: () => this._back(), onChanged: () => this._reload(SOON),
      onSource: (number, second) => this._openNumber(number, second),
      nameOf: number => this._nameOf(number)});
    this._title = element('h2', {class: 'unseen'}, page.t('memory.title'));
    this._problem = element('p', {class: 'note', role: 'status', hidden: true});
    this._tasks = this._taskChoice();
    root.append(element('div', {class: 'memory-side'}, this._title, this._tasks, this._problem,
      makeUndo(page, () => this._reload(SOON)), this._list.root), this._player.root);
    page.on('state', state => this._hear(state));
    page.on('room', ({name}) => name === 'memory' && this._reload(0));
  }

  /** @param {import('../types.js').State} state */
  _hear({episodes, task}) {
    const key = `${task} ${episodes}`;
    if (key !== this._key) {
      this._key = key;
      this._reload(SOON);
    }
  }

  /** @param {number} wait Ask for the list, [ms] from now. */
  _reload(wait) {
    clearTimeout(this._timer);
    this._timer = window.setTimeout(() => void this._load(), wait);
  }

  async _load() {
    if (this._page.room !== 'memory') {
      return;
    }
    this._n += 1;
    const n = this._n;
    const task = this._task || this._page.state.task;
    try {
      const rows = /** @type {Rows} */ (
        await askJson(`/api/episodes?task=${encodeURIComponent(task)}`));
      if (n === this._n) {
        this._show(rows);
      }
    } catch (error) {
      const {text, details} = wordsFor(this._page, error);
      this._problem.hidden = false;
      this._problem.replaceChildren(text, details ? element('details', {},
        element('summary', {}, this._page.t('page.details')), details) : '');
      this._reload(OFTEN);
    }
  }

  /** @param {Rows} rows */
  _show(rows) {
    this._problem.hidden = true;
    this._rows = rows.episodes;
    this._list.show(rows);
    this._showTasks(rows);
    const looked = this._player.row;
    if (looked) {
      const row = rows.episodes.find(({name}) => name === looked.name);
      if (row) {
        this._player.update(row);
      } else if (looked.name.startsWith(`${rows.task}/`)) {
        this._player.gone();
      }
    }
    if (!rows.complete) {
      this._reload(SOON);
    } else if (rows.episodes.some(({state}) => state === 'recording')) {
      this._reload(OFTEN);
    }
  }

  /** @param {Row} row @param {number} [at] [s] */
  _open(row, at = 0) {
    this._root.classList.add('looking');
    this._list.choose(row.name);
    void this._player.open(row, at);
    this._player.focus();
  }

  /** @param {number} number @param {number} second Show where something was learnt. */
  _openNumber(number, second) {
    const row = this._rows.find(each => each.number === number);
    if (row) {
      this._open(row, second);
    }
  }

  /** @param {number} number @returns {string} Such as “Drive 3”; there may be none any more. */
  _nameOf(number) {
    const row = this._rows.find(each => each.number === number);
    return row ? titleOf(this._page, row) : this._page.t('memory.number', {number: String(number)});
  }

  _back() {
    const name = this._player.row?.name ?? '';
    this._root.classList.remove('looking');
    this._player.close();
    this._list.choose('');
    this._list.focus(name);
  }

  _taskChoice() {
    const choice = element('select', {onchange: () => {
      this._task = choice.value;
      this._back();
      this._reload(0);
    }});
    return element('label', {class: 'task', hidden: true},
      `${this._page.t('memory.task')} `, choice);
  }

  /** @param {Rows} rows Offer the tasks, where there are several. */
  _showTasks({task, tasks}) {
    const choice = /** @type {HTMLSelectElement} */ (this._tasks.querySelector('select'));
    const names = [...new Set([...tasks, task])].filter(Boolean).sort();
    this._tasks.hidden = names.length < 2;
    if (names.join() !== [...choice.options].map(({value}) => value).join()) {
      choice.replaceChildren(...names.map(name => element('option', {value: name}, name)));
    }
    choice.value = task;
  }
}

/** @param {Page} page @param {() => void} onDone */
function makeUndo(page, onDone) {
  const button = element('button', {type: 'button', class: 'undo', hidden: true,
    onclick: async () => {
      await page.act('undo');
      onDone();
    }}, page.t('teach.undo'));
  page.on('state', ({can_undo: can}) => {
    button.hidden = !can;
  });
  return button;
}

/**
 * Fill the room; it is called when the room is entered for the first time.
 *
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  new Room(root, page);
}
