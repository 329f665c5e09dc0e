/** How fast it goes when the pad is pressed to its edge. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */

const STORED = 'speed';
const SLOWEST = 0.1;

/**
 * Make the slider; keys that ask for `faster` or `slower` move it, too.
 *
 * @param {Page} page
 * @returns {HTMLElement}
 */
export function makeSpeed(page) {
  const range = element('input', {
    type: 'range', min: SLOWEST, max: 1, step: 'any',
    value: Number(localStorage.getItem(STORED)) || 1, oninput: () => choose(page, range),
  });
  choose(page, range);
  page.next('asked', ({action}) => {
    const factor = {faster: 1.1, slower: 1 / 1.1}[/** @type {string} */ (action)];
    if (factor) {
      range.value = String(Number(range.value) * factor);
      choose(page, range);
    }
  });
  return element('div', {class: 'speed'},
    element('small', {class: 'keys'}, page.t('drive.hint')),
    element('label', {}, element('span', {}, page.t('drive.speed')), range));
}

/** @param {Page} page @param {HTMLInputElement} range */
function choose(page, range) {
  page.drive.setShare(Number(range.value));
  range.setAttribute('aria-valuetext', page.words.share(Number(range.value)));
  localStorage.setItem(STORED, range.value);
}
