/** How fast it goes when the pad is pressed to its edge. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */

/** @param {Page} page @returns {HTMLElement} */
export function makeSpeed(page) {
  const range = element('input', {
    type: 'range', min: 0.05, max: 1, step: 0.05, id: 'speed',
    onchange: () => page.post('/api/actions/set_speeds', {share: Number(range.value)}),
  });
  return element('label', {class: 'speed'},
    element('span', {}, page.t('drive.speed')), range);
}
