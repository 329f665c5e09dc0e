/** @typedef {import('../page.js').Page} Page */

import {element} from '../dom.js';

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  root.append(element('canvas', {role: 'img', 'aria-label': page.t('live.map')}));
}
