/** The map as the robot knows it, live. */

import {element} from '../dom.js';
import {followGestures, makeZoom} from './gestures.js';
import {Glide} from './glide.js';
import {makeLegend} from './legend.js';
import {MapView} from './map_view.js';
import {makePlaces} from './places.js';
import {describe} from './words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').State} State */

/** How often the map is put into words, [ms]: nobody can listen faster. */
const WORDS_PERIOD = 2000;
const SHOWN = /** @type {const} */ (
  ['field', 'prototypes', 'truth', 'sight', 'robot', 'movers', 'decision']);

/**
 * @param {HTMLElement} root
 * @param {Page} page
 * @returns {MapView}
 */
export function mount(root, page) {
  const canvas = element('canvas', {role: 'img', 'aria-label': page.t('live.map')});
  const view = new MapView(canvas);
  view.glide = new Glide();
  root.append(canvas, makePlaces(view, page), makeZoom(view, page), makeLegend(page),
    makeCaption(page));
  followGestures(view);
  listen(view, page);
  page.on('state', state => showState(view, state));
  putIntoWords(canvas, page);
  return view;
}

/** @param {Page} page Says how much of the map leads to the goal. @returns {HTMLElement} */
function makeCaption(page) {
  const caption = element('figcaption', {hidden: true});
  page.on('state', ({basin, prototypes}) => {
    caption.hidden = basin === null || prototypes < 1;
    caption.textContent = page.t('live.share', {share: page.words.share(basin ?? 0)});
  });
  return caption;
}

/** @param {MapView} view @param {Page} page */
function listen(view, page) {
  // What was shown before the connection was lost may be no more.
  page.next('connection', ({open}) => open && SHOWN.forEach(name => view.show(name, null)));
  for (const name of SHOWN) {
    page.on(name, frame => view.show(name, frame));
  }
  page.on('trail', ({points, kind}) => view.showTrail(points, kind ?? ''));
  page.on('trail_more', ({points}) => view.showTrail(points));
}

/** @param {MapView} view @param {State} state */
function showState(view, {goal, start, phase}) {
  view.showIfNew('goal', goal);
  view.showIfNew('start', start);
  if (phase !== 'trial') {
    view.showIfNew('decision', null);
  }
}

/** @param {HTMLElement} canvas @param {Page} page */
function putIntoWords(canvas, page) {
  /** @type {any} */
  let robot = null;
  /** @type {any} */
  let sight = null;
  page.on('robot', frame => {
    robot = frame;
  });
  page.on('sight', frame => {
    sight = frame;
  });
  setInterval(() => {
    const words = `${page.t('live.map')}. ${describe(page, robot, sight)}`;
    if (canvas.getAttribute('aria-label') !== words) {
      canvas.setAttribute('aria-label', words);
    }
  }, WORDS_PERIOD);
}
