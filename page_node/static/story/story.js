/** @typedef {import('../page.js').Page} Page */

/**
 * Fill the room; it is called when the room is entered for the first time.
 *
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  root.textContent = page.t('room.story');
}
