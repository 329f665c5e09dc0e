/** How a trial stands, in words. */

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Trial} Trial */

/**
 * @param {Page} page
 * @param {Trial} trial
 * @returns {string}
 */
export function trialWords(page, trial) {
  if (!trial.number) {
    return page.t('trial.none');
  }
  const how = trial.state !== 'ended' ? page.t(`trial.${trial.state}`)
    : trial.outcome === 'goal' ? page.t('trial.goal', {n: trial.steps})
      : page.t(`outcome.${trial.outcome || 'aborted'}`);
  const why = `stopped.${trial.stop_reason}`;
  const reason = trial.outcome !== 'goal' && page.words.has(why) ? ` ${page.t(why)}` : '';
  return `${page.t('trial.number', {number: trial.number})} ${how}${reason}`;
}
