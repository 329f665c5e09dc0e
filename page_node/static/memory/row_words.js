/** A drive or a trial in words, as short as a row is. */

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('./ask.js').Row} Row */

/** @param {Page} page @param {Row} row @returns {string} Such as “Drive 3”. */
export function titleOf(page, {kind, count}) {
  return page.t(`memory.${kind}`, {number: String(count)});
}

/** @param {Page} page @param {Row} row @returns {string} When, and for how long. */
export function whenOf(page, {began, seconds}) {
  const format = new Intl.DateTimeFormat(
    page.words.language, {dateStyle: 'medium', timeStyle: 'short'});
  return [began ? format.format(new Date(began)) : '',
    typeof seconds === 'number' ? secondsText(page, seconds) : ''].filter(Boolean).join(' · ');
}

/**
 * Return how it ended, as a word and as what it is: good, bad, or neither.
 *
 * @param {Page} page
 * @param {Row} row
 * @returns {{text: string, mood: '' | 'good' | 'bad'}}
 */
export function endOf(page, row) {
  const {kind, state, outcome, learnt} = row;
  if (state === 'unread') {
    return {text: page.t('memory.reading'), mood: ''};
  }
  if (state === 'unreadable' || state === 'recording') {
    return {text: page.t(`memory.state.${state}`), mood: state === 'recording' ? '' : 'bad'};
  }
  if (kind === 'demo') {
    return {text: page.t(learnt ? 'memory.kept' : 'memory.not_kept'), mood: learnt ? 'good' : ''};
  }
  const key = `memory.outcome.${outcome}`;
  return {text: page.t(page.words.has(key) ? key : 'memory.outcome.aborted'),
    mood: outcome === 'goal' ? 'good' : outcome === 'aborted' ? '' : 'bad'};
}

/** @param {Page} page @param {Row} row @returns {string} What a person said of it. */
export function labelOf(page, {label}) {
  return label ? page.t(`memory.label.${label}`) : '';
}

/** @param {Page} page @param {Row} row @returns {string} What is wrong with it. */
export function damageOf(page, {damage}) {
  return damage && damage !== 'forgotten' ? page.t(`memory.damage.${damage}`) : '';
}

/** @param {Page} page @param {number} seconds @returns {string} Such as “1:04.2 min”. */
export function secondsText(page, seconds) {
  if (seconds < 60) {
    return page.t('memory.seconds', {seconds: Math.round(seconds * 10) / 10});
  }
  const rest = Math.floor(seconds % 60);
  return page.t('memory.minutes', {
    minutes: String(Math.floor(seconds / 60)), seconds: String(rest).padStart(2, '0')});
}
