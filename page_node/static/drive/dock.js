/** The dock: how to drive, and STOP, always in reach. */

import {element} from '../dom.js';
import {Gamepads} from './gamepad.js';
import {Keys} from './keys.js';
import {makePad} from './pad.js';
import {makeSpeed} from './speed.js';

/** @typedef {import('../page.js').Page} Page */

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  const stop = element('button', {
    id: 'stop', class: 'stop', type: 'button', 'aria-keyshortcuts': 'Space',
    onpointerdown: () => page.drive.stop(), onclick: onlyByKeyboard(() => page.drive.stop()),
  }, element('strong', {}, page.t('drive.stop')),
  element('small', {class: 'keys'}, page.t('drive.space')));
  root.append(element('div', {class: 'driving'}, makePad(page), makeSpeed(page)),
    makeDriver(page), stop);
  page.next('stopped', () => page.say(page.t('done.stop'), '', 'stop'));
  new Keys(page);
  new Gamepads(page);
}

/** @param {Page} page Says it while somebody else drives. @returns {HTMLElement} */
function makeDriver(page) {
  const driver = element('p', {class: 'driver', role: 'status'});
  page.on('driver', ({who}) => {
    driver.textContent = who === 'other' ? page.t('drive.other') : '';
  });
  return driver;
}

/**
 * A click that a pointer made has been obeyed when it went down.
 *
 * @param {() => void} act
 * @returns {(event: MouseEvent) => void}
 */
function onlyByKeyboard(act) {
  return event => event.detail === 0 && act();
}
