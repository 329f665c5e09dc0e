/** Why the robot did what it did at a moment, in sentences. */

import {secondsText} from './row_words.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {{share: number, episode: number, second: number | null, demonstrated: boolean,
 *   heading: string, from: string}} Voice */
/** @typedef {Record<string, any>} About As `page_node/memory/why.py` has it. */

/** A share below this is not worth a line. */
const LEAST = 0.01;

/**
 * @param {Page} page
 * @param {About} about
 * @returns {string} What it did, and where it has that from.
 */
export function mainSentence(page, about) {
  const last = about.decision.at(-1);
  if (!last) {
    return page.t(about.kind === 'demo' ? 'memory.why.person' : 'memory.why.nothing_yet');
  }
  const said = page.t(`memory.why.${last.kind}`, {where: directionOf(page, last.heading)});
  const refused = about.decision.length > 1 && about.decision[0].kind === 'blocked'
    ? `${page.t('memory.why.refused', {where: directionOf(page, about.decision[0].heading)})} `
    : '';
  return `${refused}${said}`;
}

/**
 * Return what else there is to say, a sentence each.
 *
 * @param {Page} page
 * @param {About} about
 * @returns {string[]}
 */
export function moreSentences(page, about) {
  return [stateSentence(page, about), fieldSentence(page, about), monitorSentence(page, about)]
    .filter(Boolean);
}

/** @param {Page} page @param {About} about @returns {string} */
function stateSentence(page, {trial}) {
  if (!trial || !trial.number) {
    return '';
  }
  const key = `stopped.${trial.stop_reason}`;
  const why = page.words.has(key) ? ` ${page.t(key)}` : '';
  if (trial.state === 'paused') {
    return page.t('memory.why.paused') + why;
  }
  if (trial.state !== 'ended') {
    return '';
  }
  const outcome = `memory.outcome.${trial.outcome}`;
  return page.t('memory.why.ended', {
    how: page.t(page.words.has(outcome) ? outcome : 'memory.outcome.aborted')})
    + (trial.outcome === 'goal' ? '' : why);
}

/** @param {Page} page @param {About} about @returns {string} */
function fieldSentence(page, about) {
  const {course, decision, no_heading: missing} = about;
  if (!course) {
    return decision.length || about.kind === 'trial'
      ? page.t(`memory.why.no_field.${missing ?? 'not_recorded'}`) : '';
  }
  if (!decision.length) {
    return '';
  }
  const said = course.source === 'curious' ? page.t('memory.why.curious')
    : course.adds_up ? '' : page.t('memory.why.unexplained');
  const doubted = course.known_ahead > 0 && course.known_ahead < 100
    ? page.t('memory.why.doubted') : '';
  // It did something else than the field says: whose say it was is told of the field.
  const other = decision.at(-1).kind === 'field' || !course.adds_up ? ''
    : page.t('memory.why.field_says', {where: directionOf(page, course.heading)});
  return [said, doubted, other].filter(Boolean).join(' ');
}

/** @param {Page} page @param {About} about @returns {string} What the collision monitor did. */
function monitorSentence(page, {command}) {
  if (command.applied === null) {
    return page.t('memory.monitor.no_command');
  }
  if (!command.clipped_by) {
    return '';
  }
  const key = `memory.monitor.${command.clipped_by}`;
  if (command.clipped_by !== 'unknown' && page.words.has(key)) {
    return page.t(key);
  }
  const [asked, applied] = [command.requested, command.applied].map(
    velocity => Math.abs(velocity[0] ?? 0));
  return page.t((asked ?? 0) > (applied ?? 0) ? 'memory.monitor.held_back'
    : 'memory.monitor.unknown');
}

/**
 * Return the prototypes with a say in the heading, and where each comes from.
 *
 * @param {Page} page
 * @param {About} about
 * @param {(number: number) => string} nameOf Names a drive or a trial.
 * @returns {{share: string, text: string, voice: Voice | null}[]} The strongest first.
 */
export function voicesOf(page, {course}, nameOf) {
  if (!course || course.sum === null) {
    return [];
  }
  /** @type {{share: number, text: string, voice: Voice | null}[]} */
  const found = course.prototypes.map((/** @type {Voice} */ voice) => (
    {share: voice.share, text: sourceOf(page, voice, nameOf), voice}));
  if (course.pull) {
    found.push({share: course.pull.share, text: page.t('memory.why.shortest'), voice: null});
  }
  return found.filter(({share}) => share >= LEAST).sort((a, b) => b.share - a.share)
    .map(({share, ...rest}) => ({share: page.words.share(share), ...rest}));
}

/**
 * @param {Page} page
 * @param {Voice} voice
 * @param {(number: number) => string} nameOf
 * @returns {string}
 */
function sourceOf(page, {episode, second, demonstrated}, nameOf) {
  if (episode < 0) {
    return page.t('memory.why.own');
  }
  const how = page.t(demonstrated ? 'memory.why.shown' : 'memory.why.tried');
  if (second === null) {
    return page.t('memory.why.from_gone', {what: nameOf(episode), how});
  }
  return page.t('memory.why.from', {what: nameOf(episode), at: secondsText(page, second), how});
}

/** @param {Page} page @param {string} heading Such as `NE`. @returns {string} */
export function directionOf(page, heading) {
  return page.t(heading === '-' ? 'memory.direction.none' : `memory.direction.${heading}`);
}
