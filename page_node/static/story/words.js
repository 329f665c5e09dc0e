/** Episodes in words. */

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./history.js').Row} Row */

/** @param {Page} page @param {Row} row @returns {string} Such as `Try 3`. */
export function titleOf(page, {kind, count}) {
  return page.t(`story.title_${kind}`, {n: count});
}

/** @param {Page} page @param {Row} row @returns {string} How it ended, in a sentence. */
export function endOf(page, {kind, steps, outcome}) {
  return page.t(kind === 'demo' ? 'story.shown' : `story.end_${outcome}`, {n: steps});
}
