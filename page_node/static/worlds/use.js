/** Keep a drawn world under a name, and let the robot be in it, for a task. */

import {element} from '../dom.js';
import {nameFrom} from './upload.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Answer} Answer */

/** What stands for a task that there is none of yet. */
const NEW = '';

export class UseForm {
  /**
   * @param {Page} page
   * @param {(name: string) => Promise<boolean>} save Keeps what is drawn; returns whether it did.
   * @param {() => void} onUsed Called when the robot is in another world.
   */
  constructor(page, save, onUsed) {
    this._page = page;
    this._save = save;
    this._onUsed = onUsed;
    this.name = element('input', {maxlength: 64, autocomplete: 'off', spellcheck: false,
      required: true, onchange: () => {
        this.name.value = nameFrom(this.name.value);
      }});
    this._task = element('select', {onchange: () => this._showNew()});
    this._newTask = element('input', {maxlength: 64, autocomplete: 'off', spellcheck: false});
    this._newLabel = element('label', {hidden: true}, page.t('worlds.task_name'), this._newTask);
    this._teach = element('a', {class: 'button', href: '#teach', hidden: true},
      page.t('worlds.teach'));
    this.root = this._form();
    page.on('state', ({task}) => this._onTask(task));
    this._shownTask = '';
    /** @type {any} */
    this._robot = null;
    page.on('robot', robot => {
      this._robot = robot;
    });
  }

  _form() {
    const {t} = this._page;
    return element('form', {class: 'fields use', onsubmit: event => {
      event.preventDefault();
      void this._use();
    }},
    element('label', {}, t('worlds.name'), this.name),
    element('button', {type: 'button', class: 'save', onclick: () => void this._keep()},
      t('worlds.save')),
    element('label', {}, t('worlds.task'), this._task), this._newLabel,
    element('button', {type: 'submit', class: 'primary'}, t('worlds.use')), this._teach);
  }

  /** Another world is drawn on. @param {string} name What it is to be called. */
  begin(name) {
    this.name.value = name;
    this._teach.hidden = true;
  }

  /** Ask which tasks there are. */
  async loadTasks() {
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
    this._task.replaceChildren(...[...names].map(name => element('option', {value: name},
      this._page.t(name === current ? 'worlds.task_now' : 'worlds.task_other', {name}))),
    element('option', {value: NEW}, this._page.t('worlds.task_new')));
    this._showNew();
  }

  /** @param {string} task The learner's. */
  _onTask(task) {
    if (task !== this._shownTask) {
      this._shownTask = task;
      void this.loadTasks();
    }
  }

  _showNew() {
    const isNew = this._task.value === NEW;
    this._newLabel.hidden = !isNew;
    this._newTask.required = isNew;
    if (isNew && !this._newTask.value) {
      this._newTask.value = nameFrom(this.name.value);
    }
  }

  /** @returns {Promise<boolean>} Whether it is kept. */
  async _keep() {
    this.name.value = nameFrom(this.name.value);
    return this.root.reportValidity() && await this._save(this.name.value);
  }

  async _use() {
    if (!await this._keep()) {
      return;
    }
    const isNew = this._task.value === NEW;
    const task = isNew ? nameFrom(this._newTask.value) : this._task.value;
    const before = this._robot;
    const answer = await this._page.post(`/api/worlds/${this.name.value}/use`,
      task === this._page.state.task || !task ? {} : {task, new: isNew});
    if (!answer.success) {
      sayRefusal(this._page, answer);
      return;
    }
    this._teach.hidden = false;
    this._page.say(this._page.t('worlds.used', {name: this.name.value}));
    this._watchRobot(before);
    this._onUsed();
  }

  /** @param {any} before Say it if the robot had to be set elsewhere. */
  _watchRobot(before) {
    let left = 15;
    const stop = this._page.on('robot', robot => {
      left -= 1;
      const isMoved = before && Math.hypot(robot.x - before.x, robot.y - before.y) > 0.02;
      if (isMoved) {
        this._page.say(this._page.t('worlds.used_moved', {name: this.name.value}));
      }
      if (isMoved || left === 0) {
        queueMicrotask(() => stop());
      }
    });
  }
}

/**
 * Say why something was refused.
 *
 * @param {Page} page
 * @param {Answer} answer
 */
export function sayRefusal(page, {code = '', message}) {
  const keys = [`worlds.no.${code}`, `refused.${code}`, `why.${code}`];
  page.say(page.t(keys.find(key => page.words.has(key)) ?? 'refused.unknown'), message);
}
