/** How the robot learnt: the paper's figures growing live, and the field's history as a film. */

import {element} from '../dom.js';
import {Curves} from './curves.js';
import {Film} from './film.js';
import {History} from './history.js';
import {endOf, titleOf} from './words.js';

/** @typedef {import('../page.js').Page} Page */

/** Columns of the table. */
const COLUMNS = /** @type {const} */ (['steps', 'prototypes', 'reinforcements', 'collisions']);

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  const nothing = element('p', {class: 'empty'}, page.t('story.empty'));
  const filmPlace = element('div', {class: 'film'});
  const curvesPlace = element('div', {class: 'curves'});
  const lines = element('tbody');
  const story = element('div', {class: 'story', hidden: true}, filmPlace,
    element('div', {class: 'figures'}, curvesPlace, element('details', {class: 'card numbers'},
      element('summary', {}, page.t('story.numbers')), element('table', {}, head(page), lines))));
  root.append(nothing, story);
  const history = new History(page);
  const film = new Film(filmPlace, page, history, row => curves.choose(row));
  const curves = new Curves(curvesPlace, page, history, row => film.choose(row));
  history.onChange = () => {
    nothing.hidden = history.rows.length > 0;
    story.hidden = !history.rows.length;
    film.update();
    curves.draw();
    lines.replaceChildren(...history.rows.map(row => line(page, history, row)));
  };
  page.on('room', ({name}) => name === 'story' || film.stop());
  history.refresh(true);
}

/** @param {Page} page */
function head(page) {
  return element('thead', {}, element('tr', {},
    element('td'), ...COLUMNS.map(
      name => element('th', {scope: 'col'}, page.t(`story.${name}`)))));
}

/**
 * @param {Page} page
 * @param {History} history
 * @param {import('./history.js').Row} row
 */
function line(page, history, row) {
  const values = {...row, prototypes: history.prototypesAfter(row)};
  const sign = row.kind === 'demo' ? '' : row.outcome === 'goal' ? ' ✓' : ' ✕';
  return element('tr', {}, element('th', {scope: 'row'}, titleOf(page, row),
    element('span', {'aria-hidden': 'true'}, sign),
    element('span', {class: 'unseen'}, ` ${endOf(page, row)}`)),
    ...COLUMNS.map(name => element('td', {class: 'number'},
      values[name] === null ? '–' : page.words.number(values[name] ?? 0))));
}
