/** The pad: press and hold where the robot shall go; by mouse, finger, or its buttons by keys. */

import {element, icon} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */

/** From this share of the radius on it is full speed; within the least, the robot stands. */
const FULL = 0.72;
const LEAST = 0.14;
/** Nearer than this to straight ahead or to turning on the spot is meant so, [rad]. */
const SNAP = 0.26;
/** How long a press lasts of somebody who cannot hold it, such as a screen reader, [ms]. */
const TAP = 300;

/** Name, v, w, and the picture of each button. @type {[string, number, number, string][]} */
const BUTTONS = [
  ['ahead', 1, 0, 'M5 15l7-7 7 7'], ['left', 0, 1, 'M15 5l-7 7 7 7'],
  ['right', 0, -1, 'M9 5l7 7-7 7'], ['back', -1, 0, 'M5 9l7 7 7-7'],
];

/**
 * Return how to move for a point of the pad.
 *
 * @param {number} x Of the radius, to the right.
 * @param {number} y Of the radius, down.
 * @returns {[v: number, w: number]}
 */
export function moveFromPoint(x, y) {
  const radius = Math.hypot(x, y);
  if (radius < LEAST) {
    return [0, 0];
  }
  const size = Math.min(1, (radius - LEAST) / (FULL - LEAST));
  const quarter = Math.PI / 2;
  let angle = Math.atan2(-x, -y);
  const straight = Math.round(angle / quarter) * quarter;
  angle = Math.abs(angle - straight) < SNAP ? straight : angle;
  return [tidy(size * Math.cos(angle)), tidy(size * Math.sin(angle))];
}

/** @param {number} share @returns {number} The same, without what only rounding made. */
function tidy(share) {
  return Math.round(share * 1000) / 1000 || 0;
}

/** @param {Page} page @returns {HTMLElement} */
export function makePad(page) {
  const knob = element('span', {class: 'knob'});
  const pad = element('div', {class: 'pad', role: 'group', 'aria-label': page.t('drive.pad')},
    ...BUTTONS.map(button => makeButton(page, ...button)), knob);
  followPointer(page, pad);
  page.on('move', ({v, w}) => {
    knob.style.transform = `translate(${-w * 90}%, ${-v * 90}%)`;
    pad.classList.toggle('held', Boolean(v || w));
  });
  page.on('driver', ({who}) => pad.classList.toggle('taken', who === 'other'));
  return pad;
}

/**
 * @param {Page} page
 * @param {string} name
 * @param {number} v
 * @param {number} w
 * @param {string} picture
 * @returns {HTMLElement}
 */
function makeButton(page, name, v, w, picture) {
  const source = `button ${name}`;
  return element('button', {
    type: 'button', class: name, 'aria-label': page.t(`drive.${name}`),
    onkeydown: /** @param {KeyboardEvent} event */ event => {
      if (event.key === 'Enter') {
        event.preventDefault();
        page.drive.hold(source, v, w);
      }
    },
    onkeyup: () => page.drive.release(source),
    onblur: () => page.drive.release(source),
    onclick: /** @param {MouseEvent} event */ event => {
      if (event.detail === 0) {
        page.drive.hold(source, v, w);
        setTimeout(() => page.drive.release(source), TAP);
      }
    },
  }, icon(picture));
}

/** @param {Page} page @param {HTMLElement} pad */
function followPointer(page, pad) {
  let held = -1;
  /** @param {PointerEvent} event */
  const follow = event => {
    if (event.pointerId === held) {
      const box = pad.getBoundingClientRect();
      page.drive.hold('pad', ...moveFromPoint(
        (2 * (event.clientX - box.left)) / box.width - 1,
        (2 * (event.clientY - box.top)) / box.height - 1));
    }
  };
  pad.addEventListener('pointerdown', event => {
    if (event.button === 0 && held < 0) {
      held = event.pointerId;
      pad.setPointerCapture(held);
      follow(event);
    }
  });
  pad.addEventListener('pointermove', follow);
  const release = () => {
    held = -1;
    page.drive.release('pad');
  };
  pad.addEventListener('lostpointercapture', release);
  pad.addEventListener('contextmenu', event => event.preventDefault());
  page.next('released', () => {
    held = -1;
  });
}
