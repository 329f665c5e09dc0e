/** A robot that glides from where it was told to be to where it is told next. */

/** @typedef {{x: number, y: number, yaw: number, radius?: number}} Placed */

/** Time in which two thirds of what is left are made good, [s]. */
const LAG = 0.05;
/** Farther than this it was set, not driven, [m]; nearer it is there, [m] and [rad]. */
const LEAP = 0.6;
const THERE = 0.002;

export class Glide {
  constructor() {
    /** @type {Placed | null} */
    this._shown = null;
    this._at = 0;
    this._isCalm = matchMedia('(prefers-reduced-motion: reduce)');
  }

  /**
   * Return where to draw it now, and whether it has yet to move on.
   *
   * @param {Placed} target
   * @param {number} now [ms]
   * @returns {[Placed, boolean]}
   */
  towards(target, now) {
    const before = this._shown;
    const seconds = (now - this._at) / 1000;
    this._at = now;
    const dx = target.x - (before?.x ?? Infinity);
    const dy = target.y - (before?.y ?? Infinity);
    if (!before || this._isCalm.matches || !(Math.hypot(dx, dy) < LEAP)) {
      this._shown = target;
      return [target, false];
    }
    const turn = Math.atan2(Math.sin(target.yaw - before.yaw), Math.cos(target.yaw - before.yaw));
    const isThere = Math.hypot(dx, dy, turn) < THERE;
    const share = isThere ? 1 : 1 - Math.exp(-seconds / LAG);
    this._shown = {...target, x: before.x + share * dx, y: before.y + share * dy,
      yaw: before.yaw + share * turn};
    return [this._shown, !isThere];
  }
}
