/** Where one more drive helps most: buttons on the map, which set a simulated robot there. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Point} Point */
/** @typedef {import('../types.js').Truth} Truth */
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
  /** @type {Truth | null} */
  let truth = null;
  const refresh = () => {
    const {teach_here: all, phase, simulation} = page.state;
    const found = all.filter(place => !simulation || !truth || isFree(truth, place));
    if (JSON.stringify(found) !== JSON.stringify(places)) {
      places = found;
      root.replaceChildren(...places.map((place, index) => makePlace(page, place, index)));
    }
    root.hidden = phase !== 'idle';
    move();
  };
  page.on('truth', frame => {
    truth = frame;
    refresh();
  });
  page.on('state', refresh);
  view.onMoved = move;
  return root;
}

/**
 * Return whether a simulated robot can be set to a place: what was never seen may be a wall.
 *
 * @param {Truth} truth
 * @param {Point} place
 * @returns {boolean}
 */
function isFree({rows, cols, resolution, origin, occupancy}, [x, y]) {
  const col = Math.floor((x - origin[0]) / resolution);
  const row = Math.floor((y - origin[1]) / resolution);
  return row >= 0 && row < rows && col >= 0 && col < cols
    && (occupancy[row * cols + col] ?? 100) <= 50;
}

/** @param {Page} page @param {Point} place @param {number} index @returns {HTMLElement} */
function makePlace(page, [x, y], index) {
  const name = page.t('live.teach_here', {n: index + 1});
  return element('button', {
    type: 'button', class: 'place', title: name, 'aria-label': name,
    onclick: () => page.act('teach_here', {x, y}),
  }, element('span', {}, String(index + 1)));
}
