/** Looking closer: wheel, drag, two fingers, double click, and buttons for who has only keys. */

import {element, icon} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./map_view.js').MapView} MapView */

const STEP = 1.4;
/** Factor of each button; 0 shows all. @type {[string, number, string][]} */
const BUTTONS = [['closer', STEP, 'M12 6v12M6 12h12'], ['farther', 1 / STEP, 'M6 12h12'],
  ['all', 0, 'M5 9V5h4M15 5h4v4M19 15v4h-4M9 19H5v-4']];

/** @param {MapView} view @param {Page} page @returns {HTMLElement} */
export function makeZoom(view, page) {
  return element('div', {class: 'zoom', role: 'group', 'aria-label': page.t('live.zoom')},
    ...BUTTONS.map(([name, factor, picture]) => element('button', {
      type: 'button', 'aria-label': page.t(`live.${name}`), onclick: () => view.zoom(factor),
    }, icon(picture))));
}

/** @param {MapView} view Let mouse and fingers move it. */
export function followGestures(view) {
  const {canvas} = view;
  /** @type {Map<number, {x: number, y: number}>} */
  const fingers = new Map();
  canvas.addEventListener('wheel', event => {
    event.preventDefault();
    view.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
  }, {passive: false});
  canvas.addEventListener('dblclick', () => view.zoom(0));
  canvas.addEventListener('pointerdown', event => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, {x: event.offsetX, y: event.offsetY});
  });
  canvas.addEventListener('pointermove', event => {
    if (fingers.has(event.pointerId)) {
      move(view, fingers, event);
    }
  });
  canvas.addEventListener('lostpointercapture', ({pointerId}) => fingers.delete(pointerId));
}

/**
 * @param {MapView} view
 * @param {Map<number, {x: number, y: number}>} fingers
 * @param {PointerEvent} event
 */
function move(view, fingers, {pointerId, offsetX: x, offsetY: y}) {
  const before = fingers.get(pointerId) ?? {x, y};
  const other = [...fingers].find(([id]) => id !== pointerId)?.[1];
  fingers.set(pointerId, {x, y});
  if (other) {
    const apart = Math.hypot(before.x - other.x, before.y - other.y);
    view.zoom(Math.hypot(x - other.x, y - other.y) / Math.max(apart, 1), other.x, other.y);
  } else if (!view.viewport.isFitted) {
    view.pan(x - before.x, y - before.y);
  }
}
