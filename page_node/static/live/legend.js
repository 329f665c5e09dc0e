/** What the colours of the map mean. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */

const SIGNS = [
  'home', 'lost', 'wall', 'near', 'truth', 'shown', 'learnt', 'goal', 'start', 'place'];

/** @param {Page} page @returns {HTMLElement} */
export function makeLegend(page) {
  const signs = SIGNS.map(name => element('li', {class: `sign ${name}-sign`},
    element('span', {class: 'swatch', 'aria-hidden': 'true'}), page.t(`sign.${name}`)));
  page.on('state', ({simulation, prototypes, teach_here: places}) => {
    signs[SIGNS.indexOf('truth')]?.toggleAttribute('hidden', !simulation);
    signs[SIGNS.indexOf('place')]?.toggleAttribute('hidden', !places.length);
    for (const name of ['home', 'lost', 'shown', 'learnt']) {
      signs[SIGNS.indexOf(name)]?.toggleAttribute('hidden', prototypes <= 0);
    }
  });
  return element('details', {class: 'legend'},
    element('summary', {}, page.t('sign.title')), element('ul', {}, ...signs));
}
