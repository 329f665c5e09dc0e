/** Where one more drive helps most: buttons on the map, which set a simulated robot there. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Point} Point */
/** @typedef {import('./map_view.js').MapView} MapView */

/** @param {MapView} view @param {Page} page @returns {HTMLElement} */
export function makePlaces(view, page) {
  const root = element('div', {class: 'places'});
  /** @type {Point[]} */
  let places = [];
  const move = () => [...root.children].forEach((button, index) => {
    const [x, y] = view.viewport.toScreen(...(places[index] ?? [0, 0]));
    /** @type {HTMLElement} */ (button).style.transform = `translate(${x}px, ${y}px)`;
  });
  page.on('state', state => {
    if (JSON.stringify(state.teach_here) !== JSON.stringify(places)) {
      places = state.teach_here;
      root.replaceChildren(...places.map((place, index) => makePlace(page, place, index)));
    }
    root.hidden = state.phase !== 'idle';
    move();
  });
  view.onMoved = move;
  return root;
}

/** @param {Page} page @param {Point} place @param {number} index @returns {HTMLElement} */
function makePlace(page, [x, y], index) {
  const name = page.t('live.teach_here', {n: index + 1});
  return element('button', {
    type: 'button', class: 'place', title: name, 'aria-label': name,
    onclick: () => page.act('teach_here', {x, y}),
  }, element('span', {}, String(index + 1)));
}
