/** Keep a drawn world under a name, and let the robot be in it, for a task. */

import {element} from '../dom.js';
import {sayRefusal} from './refusals.js';
import {TaskChoice} from './task_choice.js';
import {nameFrom} from './upload.js';

/** @typedef {import('../page.js').Page} Page */

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
    this._task = new TaskChoice(page, () => this.name.value);
    this._teach = element('a', {class: 'button', href: '#teach', hidden: true},
      page.t('worlds.teach'));
    this.root = this._form();
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
    ...this._task.parts,
    element('button', {type: 'submit', class: 'primary'}, t('worlds.use')), this._teach);
  }

  /** Another world is drawn on. @param {string} name What it is to be called. */
  begin(name) {
    this.name.value = name;
    this._teach.hidden = true;
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
    const before = this._robot;
    const answer = await this._page.post(`/api/worlds/${this.name.value}/use`,
      this._task.wanted ?? {});
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
