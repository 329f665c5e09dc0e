/** @typedef {import('../page.js').Page} Page */

import {element} from '../dom.js';
import {mount as mountLive} from '../live/live.js';

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  const live = element('figure', {class: 'live'});
  root.append(live);
  mountLive(live, page);
}
