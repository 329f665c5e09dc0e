/** A drive that was loaded: what was so at any moment of it. */

/** @typedef {import('../types.js').Point} Point */
/** @typedef {{at: number, trial: number, state: string, outcome: string, stop_reason: string,
 *   reason: string}} Status */
/** @typedef {{at: number, x: number, y: number, heading: number, kind: number,
 *   reward: number}} Decision */

/** As `control_field.records.Kind` has them. */
export const KINDS = ['field', 'blocked', 'avoid', 'explore', 'taught', 'detour'];
/** Steps to the eight cells around, by heading: columns and rows. */
const AROUND = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];
/** A way is drawn by points this far apart, [m]. */
const APART = 0.01;

export class Replay {
  /** @param {import('../binary.js').Frame} frame */
  constructor(frame) {
    this.frame = frame;
    /** @type {number} */
    this.seconds = frame.seconds;
    /** @type {[number, number][]} */
    this.holes = frame.holes;
    /** @type {Status[]} */
    this.statuses = frame.statuses;
    /** When each field came into force. @type {number[]} */
    this.fields = frame.fields;
    this.decisions = this._readDecisions();
    this._points = this._readPoints();
  }

  /**
   * Return where the robot was, between two poses if need be.
   *
   * @param {number} at [s]
   * @returns {{x: number, y: number, yaw: number, v: number, w: number}}
   */
  poseAt(at) {
    const {t, x, y, yaw, v, w} = this.frame;
    const i = Math.max(0, before(t, at));
    const j = Math.min(i + 1, t.length - 1);
    const share = t[j] > t[i] && !this.holeAt(at) ? Math.min(1, Math.max(
      0, (at - t[i]) / (t[j] - t[i]))) : 0;
    const turn = Math.atan2(Math.sin(yaw[j] - yaw[i]), Math.cos(yaw[j] - yaw[i]));
    return {x: x[i] + share * (x[j] - x[i]), y: y[i] + share * (y[j] - y[i]),
      yaw: yaw[i] + share * turn, v: v[i], w: w[i]};
  }

  /** @param {number} at [s] @returns {Decision | null} The one in force. */
  decisionAt(at) {
    return this.decisions[before(this.frame.d_t, at)] ?? null;
  }

  /** @param {number} at [s] @returns {Status | null} */
  statusAt(at) {
    return this.statuses[before(this.statuses.map(status => status.at), at + 1e-3)] ?? null;
  }

  /** @param {number} at [s] @returns {[number, number] | null} Where nothing was recorded. */
  holeAt(at) {
    return this.holes.find(([from, to]) => from < at && at < to) ?? null;
  }

  /** @param {number} at [s] @returns {number} Which field was in force; -1 for none. */
  fieldAt(at) {
    return before(this.fields, at + 1e-3);
  }

  /**
   * Return what was seen around the robot, as a frame of the map.
   *
   * @param {number} at [s]
   */
  sightAt(at) {
    const {g_t: times, g_x: xs, g_y: ys, g_blocked: blocked, g_unknown: unknown,
      resolution} = this.frame;
    const i = before(times, at);
    if (i < 0) {
      return null;
    }
    const cells = new Array(9).fill(0);
    AROUND.forEach(([col, row], heading) => {
      const place = 4 + 3 * (row ?? 0) + (col ?? 0);
      cells[place] = blocked[i] >> heading & 1 ? 100 : unknown[i] >> heading & 1 ? -1 : 0;
    });
    return {type: 'sight', rows: 3, cols: 3, resolution, x0: xs[i] - 1.5 * resolution,
      y0: ys[i] - 1.5 * resolution, cells};
  }

  /**
   * Return the way driven between two moments.
   *
   * @param {number} from [s]
   * @param {number} to [s]
   * @returns {Point[]}
   */
  way(from, to) {
    const {times, points} = this._points;
    return points.slice(before(times, from) + 1, before(times, to) + 1);
  }

  /** @returns {Point} Where it began. */
  get first() {
    return [this.frame.x[0], this.frame.y[0]];
  }

  /**
   * Return when the decision before or after a moment was made.
   *
   * @param {number} at [s]
   * @param {1 | -1} direction
   * @returns {number} [s]
   */
  nextDecision(at, direction) {
    const times = this.decisions.map(decision => decision.at);
    const found = direction > 0 ? times.find(time => time > at + 0.02)
      : times[before(times, at - 0.02)];
    return Math.max(0, found ?? (direction > 0 ? this.seconds : 0));
  }

  _readDecisions() {
    const {d_t: t, d_x: x, d_y: y, d_heading: heading, d_kind: kind, d_reward: reward}
      = this.frame;
    return Array.from(t, (at, i) => (
      {at: Number(at), x: x[i], y: y[i], heading: heading[i], kind: kind[i], reward: reward[i]}));
  }

  /** @returns {{times: number[], points: Point[]}} The way, without what cannot be told apart. */
  _readPoints() {
    const {t, x, y} = this.frame;
    const times = [];
    /** @type {Point[]} */
    const points = [];
    let last = [Infinity, Infinity];
    for (let i = 0; i < t.length; i += 1) {
      if (Math.hypot(x[i] - (last[0] ?? 0), y[i] - (last[1] ?? 0)) >= APART) {
        last = [x[i], y[i]];
        times.push(t[i]);
        points.push([x[i], y[i]]);
      }
    }
    return {times, points};
  }
}

/**
 * Return the last place whose time is not after a moment; -1 if there is none.
 *
 * @param {ArrayLike<number>} times Never falling.
 * @param {number} at
 * @returns {number}
 */
export function before(times, at) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? 0) <= at + 1e-4) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low - 1;
}
