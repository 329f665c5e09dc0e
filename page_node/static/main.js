/** Starts the page: words, rooms, sockets. */

import {mount as mountDrive} from './drive/dock.js';
import {Drive} from './drive/drive.js';
import {element, translate} from './dom.js';
import {chooseLanguage, LANGUAGES, loadWords, preferredLanguage} from './i18n.js';
import {mount as mountSentence} from './live/sentence.js';
import {mount as mountMemory} from './memory/memory.js';
import {Page} from './page.js';
import {mount as mountStory} from './story/story.js';
import {mount as mountTeach} from './teach/teach.js';
import {mount as mountWorlds} from './worlds/worlds.js';

/** @type {Record<string, (root: HTMLElement, page: Page) => void>} */
const ROOMS = {
  teach: mountTeach, memory: mountMemory, story: mountStory, worlds: mountWorlds,
};
/** Rooms that are there in simulation only. */
const SIMULATED = ['worlds'];

/** @param {string} id @returns {HTMLElement} */
function place(id) {
  return /** @type {HTMLElement} */ (document.getElementById(id));
}

/** Rooms, and the links that lead to them. */
class Rooms {
  /** @param {Page} page */
  constructor(page) {
    this._page = page;
    /** @type {Map<string, HTMLAnchorElement>} */
    this._links = new Map();
    this._mounted = new Set();
    for (const name of Object.keys(ROOMS)) {
      const link = element('a', {href: `#${name}`}, page.t(`room.${name}`));
      link.hidden = SIMULATED.includes(name);
      this._links.set(name, link);
    }
    place('rooms').append(...this._links.values());
    page.on('state', ({simulation, phase, trial, advice}) => {
      Object.assign(document.body.dataset, {phase, trial: trial.state, advice: advice.code});
      SIMULATED.forEach(name => this._links.get(name)?.toggleAttribute('hidden', !simulation));
    });
    addEventListener('hashchange', () => this.show());
  }

  /** Show the room that the address names. */
  show() {
    const wanted = location.hash.slice(1);
    const room = Object.hasOwn(ROOMS, wanted) ? wanted : 'teach';
    document.body.dataset.room = room;
    for (const [name, link] of this._links) {
      place(`room-${name}`).hidden = name !== room;
      link.toggleAttribute('aria-current', name === room);
      if (name === room) {
        link.setAttribute('aria-current', 'page');
      }
    }
    // The map hears of the way driven from the beginning, whatever room is shown.
    ['teach', room].forEach(name => this._mount(name));
    this._page.room = room;
    this._page.tell({type: 'room', name: room});
  }

  /** @param {string} name Fill a room, once. */
  _mount(name) {
    if (!this._mounted.has(name)) {
      this._mounted.add(name);
      ROOMS[name]?.(place(`room-${name}`), this._page);
    }
  }
}

/** @param {Page} page Offer the languages there are. */
function offerLanguages(page) {
  const select = /** @type {HTMLSelectElement} */ (place('language'));
  for (const [tag, name] of Object.entries(LANGUAGES)) {
    select.append(element('option', {value: tag, lang: tag}, name));
  }
  select.value = page.words.language;
  select.addEventListener('change', () => chooseLanguage(select.value));
}

async function start() {
  const page = new Page(await loadWords(preferredLanguage()));
  document.documentElement.lang = page.words.language;
  document.title = page.t('page.title');
  translate(document, page.t);
  offerLanguages(page);
  page.drive = new Drive(page);
  mountSentence(place('sentence'), page);
  mountDrive(place('dock'), page);
  new Rooms(page).show();
  page.connect();
}

void start();
