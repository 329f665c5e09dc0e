/** The list of drives and trials, the newest first, with a small picture each. */

import {element} from '../dom.js';
import {pathOf} from './ask.js';
import {damageOf, endOf, labelOf, titleOf, whenOf} from './row_words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./ask.js').Row} Row */
/** @typedef {import('./ask.js').Rows} Rows */

/** States that say already what is wrong. */
const SAID = ['recording', 'unreadable'];

export class List {
  /**
   * @param {Page} page
   * @param {(row: Row) => void} onChosen
   */
  constructor(page, onChosen) {
    this._page = page;
    this._onChosen = onChosen;
    this._chosen = '';
    this._rows = element('ol', {class: 'episodes', role: 'list'});
    this._forgotten = element('ol', {class: 'episodes', role: 'list'});
    this._bin = element('details', {hidden: true},
      element('summary', {}, page.t('memory.forgotten')), this._forgotten);
    this._note = element('p', {class: 'quiet', hidden: true});
    this.root = element('div', {class: 'memory-list'}, this._rows, this._bin, this._note);
    /** Rows that are shown, by name. @type {Map<string, {row: string, item: HTMLElement}>} */
    this._shown = new Map();
  }

  /** @param {Rows} rows Show these from now on; what is as it was is left as it is. */
  show({episodes, others}) {
    const kept = new Map();
    for (const [place, isForgotten] of /** @type {const} */ (
      [[this._rows, false], [this._forgotten, true]])) {
      const rows = episodes.filter(({forgotten}) => forgotten === isForgotten);
      rows.forEach((row, index) => {
        const item = this._item(row);
        kept.set(row.name, {row: JSON.stringify(row), item});
        if (place.children[index] !== item) {
          place.insertBefore(item, place.children[index] ?? null);
        }
      });
      while (place.children.length > rows.length) {
        place.lastElementChild?.remove();
      }
    }
    this._shown = kept;
    this._bin.hidden = !this._forgotten.children.length;
    this._say(episodes.length, others);
    this.choose(this._chosen);
  }

  /** @param {string} name Mark the row that is looked at. */
  choose(name) {
    this._chosen = name;
    for (const [each, {item}] of this._shown) {
      item.firstElementChild?.setAttribute('aria-current', String(each === name));
    }
  }

  /** @param {string} name Give a row the focus. */
  focus(name) {
    const button = this._shown.get(name)?.item.firstElementChild;
    /** @type {HTMLElement | undefined} */ (button)?.focus();
  }

  /** @param {number} n @param {string[]} others */
  _say(n, others) {
    const said = [n ? '' : this._page.t('memory.empty'), others.length
      ? this._page.t('memory.others', {names: others.join(', ')}) : ''].filter(Boolean);
    this._note.hidden = !said.length;
    this._note.textContent = said.join(' ');
  }

  /** @param {Row} row @returns {HTMLElement} The one there is, if nothing has changed. */
  _item(row) {
    const shown = this._shown.get(row.name);
    if (shown && shown.row === JSON.stringify(row)) {
      return shown.item;
    }
    shown?.item.remove();
    return element('li', {}, this._button(row));
  }

  /** @param {Row} row */
  _button(row) {
    const {text, mood} = endOf(this._page, row);
    const damage = SAID.includes(row.state) ? '' : damageOf(this._page, row);
    const label = labelOf(this._page, row);
    return element('button', {
      type: 'button', class: `episode ${row.kind}`, 'data-name': row.name,
      onclick: () => this._onChosen(row),
    }, picture(row), element('span', {class: 'what'},
      element('strong', {}, titleOf(this._page, row)),
      element('span', {class: `end ${mood}`}, text),
      label && element('span', {class: 'end'}, label),
      damage && element('span', {class: 'end bad'}, damage),
      element('small', {}, whenOf(this._page, row))));
  }
}

/** @param {Row} row @returns {HTMLElement} Nothing where there is no drive to be seen. */
function picture(row) {
  if (!row.version || row.state === 'unreadable') {
    return element('span', {class: 'picture', 'aria-hidden': 'true'});
  }
  const image = element('img', {
    class: 'picture', alt: '', loading: 'lazy', width: 120, height: 90,
    src: pathOf(row, 'thumbnail')});
  image.addEventListener('error', () => image.replaceWith(
    element('span', {class: 'picture', 'aria-hidden': 'true'})), {once: true});
  return image;
}
