/** What the buttons of a gamepad do, while there is one. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */

/** @param {HTMLElement} root @param {Page} page */
export function mountGamepadHelp(root, page) {
  const help = element('p', {class: 'gamepad', hidden: true}, page.t('teach.gamepad'));
  root.append(help);
  page.on('gamepad', ({isThere}) => {
    help.hidden = !isThere;
  });
}
