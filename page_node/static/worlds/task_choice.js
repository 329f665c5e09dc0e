/** Which task is taught: the one at hand, another one there is, or a new one. */

import {element} from '../dom.js';
import {sayRefusal} from './refusals.js';
import {nameFrom} from './upload.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {{task: string, new: boolean}} Wanted */

/** What stands for a task that there is none of yet. */
const NEW = '';

export class TaskChoice {
  /**
   * @param {Page} page
   * @param {() => string} suggest Returns how a new one may be called.
   */
  constructor(page, suggest) {
    this._page = page;
    this._suggest = suggest;
    this._shown = '';
    this._select = element('select', {onchange: () => this._showNew()});
    this._name = element('input', {maxlength: 64, autocomplete: 'off', spellcheck: false});
    this._nameLabel = element('label', {hidden: true}, page.t('worlds.task_name'), this._name);
    /** @type {HTMLElement[]} */
    this.parts = [element('label', {}, page.t('worlds.task'), this._select), this._nameLabel];
    page.on('state', ({task}) => {
      if (task !== this._shown) {
        this._shown = task;
        void this.load();
      }
    });
  }

  /** Ask which there are. */
  async load() {
    /** @type {{name: string, episodes: number}[]} */
    let tasks = [];
    try {
      ({tasks} = await this._page.json('/api/tasks'));
    } catch {
      // None is known but the one at hand.
    }
    const current = this._page.state.task;
    const names = new Set([...current ? [current] : [],
      ...tasks.filter(task => task.episodes > 0).map(task => task.name)]);
    this._select.replaceChildren(...[...names].map(name => element('option', {value: name},
      this._page.t(name === current ? 'worlds.task_now' : 'worlds.task_other', {name}))),
    element('option', {value: NEW}, this._page.t('worlds.task_new')));
    this._showNew();
  }

  /** @returns {Wanted | null} What is chosen; null if that is the task at hand. */
  get wanted() {
    const isNew = this._select.value === NEW;
    const task = isNew ? nameFrom(this._name.value) : this._select.value;
    return !task || task === this._page.state.task ? null : {task, new: isNew};
  }

  _showNew() {
    const isNew = this._select.value === NEW;
    this._nameLabel.hidden = !isNew;
    this._name.required = isNew;
    if (isNew && !this._name.value) {
      this._name.value = nameFrom(this._suggest());
    }
  }
}

/**
 * Let the task be changed where it is taught.
 *
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mountTask(root, page) {
  const choice = new TaskChoice(page, () => '');
  const summary = element('summary', {});
  const folded = element('details', {class: 'task-choice', hidden: true}, summary,
    element('form', {class: 'fields', onsubmit: event => {
      event.preventDefault();
      void change();
    }}, ...choice.parts,
    element('button', {type: 'submit', class: 'primary'}, page.t('worlds.task_begin'))));
  const change = async () => {
    const wanted = choice.wanted;
    const answer = wanted && await page.post(
      `/api/tasks/${wanted.task}/use`, {new: wanted.new});
    if (answer && !answer.success) {
      sayRefusal(page, answer);
      return;
    }
    folded.open = false;
    if (wanted) {
      page.say(page.t('worlds.task_begun', {name: wanted.task}));
    }
  };
  folded.addEventListener('toggle', () => folded.open && void choice.load());
  page.on('state', ({task}) => {
    folded.hidden = !task;
    summary.textContent = page.t('worlds.task_is', {name: task});
  });
  root.append(folded);
}
