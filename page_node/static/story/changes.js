/** What has changed in a field from one episode to the next. */

import {FLAGS} from '../live/field_layer.js';

/** @typedef {import('../types.js').Field} Field */
/** @typedef {'wall' | 'gained' | 'lost' | 'turned' | 'seen'} Kind */
/** @typedef {{kinds: Uint8Array, counts: Record<Kind, number>}} Changes */

/** What can have become of a cell; its place in here, from 1, stands in `Changes.kinds`. */
export const KINDS = /** @type {const} */ (['wall', 'gained', 'lost', 'turned', 'seen']);

/** A heading has changed from this on, in 256ths of a turn: half an eighth of it. */
const TURNED = 16;
const WALL = 100;
const [NOTHING, NEW_WALL, GAINED, LOST, TURNED_AWAY, SEEN] = [0, 1, 2, 3, 4, 5];

/**
 * Compare two fields, cell by cell, by where the cells are.
 *
 * A cell is `gained` or `lost` for the goal, a `wall` was found in it, its heading `turned`, or it
 * was `seen` to be free; what is free counts only where that is known.
 *
 * @param {Field | null} before Null before anything was learnt.
 * @param {Field} after
 * @returns {Changes}
 */
export function changesBetween(before, after) {
  const kinds = new Uint8Array(after.rows * after.cols);
  const placeBefore = placesIn(before, after);
  for (let index = 0; index < kinds.length; index += 1) {
    kinds[index] = changeOf(before, placeBefore(index), after, index);
  }
  const counts = /** @type {Record<Kind, number>} */ (
    Object.fromEntries(KINDS.map(kind => [kind, 0])));
  for (const kind of kinds) {
    const name = KINDS[kind - 1];
    if (name) {
      counts[name] += 1;
    }
  }
  return {kinds, counts};
}

/**
 * @param {Field} field
 * @returns {number} From which share of the places seen the field leads to the goal; NaN if none.
 */
export function shareHome(field) {
  let [free, home] = [0, 0];
  field.known.forEach((state, index) => {
    if (state === 0) {
      free += 1;
      home += (field.flags[index] ?? 0) & FLAGS.home ? 1 : 0;
    }
  });
  return free ? home / free : NaN;
}

/** @param {Field} field @returns {[number, number] | null} Where the goal is, [m]. */
export function goalOf({flags, cols, origin, resolution}) {
  const index = flags.findIndex(flag => (flag & FLAGS.goal) !== 0);
  return index < 0 ? null : [
    origin[0] + (index % cols + 0.5) * resolution,
    origin[1] + (Math.floor(index / cols) + 0.5) * resolution];
}

/**
 * @param {Field | null} before
 * @param {number} was Index there, -1 for none.
 * @param {Field} after
 * @param {number} index
 * @returns {number}
 */
function changeOf(before, was, after, index) {
  const known = after.known[index] ?? -1;
  const knownBefore = before && was >= 0 ? before.known[was] ?? -1 : -1;
  if (known === WALL) {
    return knownBefore === WALL ? NOTHING : NEW_WALL;
  }
  if (known !== 0) {
    return NOTHING;
  }
  const flags = after.flags[index] ?? 0;
  const flagsBefore = before && was >= 0 ? before.flags[was] ?? 0 : 0;
  const isHome = Boolean(flags & FLAGS.home);
  const wasHome = knownBefore === 0 && Boolean(flagsBefore & FLAGS.home);
  if (isHome !== wasHome) {
    return isHome ? GAINED : LOST;
  }
  const hasBoth = flags & flagsBefore & FLAGS.heading;
  if (before && hasBoth && apart(before.angle[was] ?? 0, after.angle[index] ?? 0) >= TURNED) {
    return TURNED_AWAY;
  }
  return knownBefore === 0 ? NOTHING : SEEN;
}

/** @param {number} one @param {number} other @returns {number} In 256ths of a turn, 0 to 128. */
function apart(one, other) {
  const angle = Math.abs(one - other);
  return Math.min(angle, 256 - angle);
}

/**
 * Return where a cell of one field is in another: a workspace may have grown.
 *
 * @param {Field | null} before
 * @param {Field} after
 * @returns {(index: number) => number} -1 where it is not.
 */
function placesIn(before, after) {
  if (!before || Math.abs(before.resolution - after.resolution) > 1e-6) {
    return () => -1;
  }
  const off = /** @param {0 | 1} axis */ axis => Math.round(
    (after.origin[axis] - before.origin[axis]) / after.resolution);
  const [col0, row0] = [off(0), off(1)];
  return index => {
    const row = Math.floor(index / after.cols) + row0;
    const col = index % after.cols + col0;
    const isThere = row >= 0 && col >= 0 && row < before.rows && col < before.cols;
    return isThere ? row * before.cols + col : -1;
  };
}
