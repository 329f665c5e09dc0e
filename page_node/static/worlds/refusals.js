/** Why a world or a task was refused, in words. */

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Answer} Answer */

/**
 * Say why something was refused.
 *
 * @param {Page} page
 * @param {Answer} answer
 */
export function sayRefusal(page, {code = '', message}) {
  const keys = [`worlds.no.${code}`, `refused.${code}`, `why.${code}`];
  page.say(page.t(keys.find(key => page.words.has(key)) ?? 'refused.unknown'), message);
}
