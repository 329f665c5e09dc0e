/** Which part of the world is seen, and where on the screen a point of it is. */

/** @typedef {import('../types.js').Point} Point */
/** @typedef {{x0: number, y0: number, x1: number, y1: number}} Box [m] */

/** Space around what is fitted, [px]; most and least that one metre takes, beside fitting it. */
const MARGIN = 26;
const CLOSEST = 12;

export class Viewport {
  constructor() {
    this.width = 1;
    this.height = 1;
    /** @type {Box} */
    this.box = {x0: -1, y0: -1, x1: 1, y1: 1};
    this.scale = 1; // px/m
    this._zoom = 1;
    /** Middle of what is seen. @type {Point} */
    this._middle = [0, 0];
  }

  /** @returns {boolean} Whether all of it is seen. */
  get isFitted() {
    return this._zoom === 1;
  }

  /**
   * @param {number} width [px]
   * @param {number} height [px]
   */
  resize(width, height) {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    this._place();
  }

  /** @param {Box} box What there is to see. */
  setBox(box) {
    this.box = box;
    this._place();
  }

  /** See all of it. */
  fit() {
    this._zoom = 1;
    this._place();
  }

  /**
   * @param {number} factor
   * @param {number} [x] What stays where it is on the screen, [px].
   * @param {number} [y]
   */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const before = this.toWorld(x, y);
    this._zoom = Math.min(CLOSEST, Math.max(1, this._zoom * factor));
    this._place();
    const after = this.toWorld(x, y);
    this._move(before[0] - after[0], before[1] - after[1]);
  }

  /**
   * @param {number} dx [px]
   * @param {number} dy [px]
   */
  pan(dx, dy) {
    this._move(-dx / this.scale, dy / this.scale);
  }

  /** @param {number} x [px] @param {number} y [px] @returns {Point} */
  toWorld(x, y) {
    return [this._middle[0] + (x - this.width / 2) / this.scale,
      this._middle[1] - (y - this.height / 2) / this.scale];
  }

  /** @param {number} x [m] @param {number} y [m] @returns {Point} */
  toScreen(x, y) {
    return [this.width / 2 + (x - this._middle[0]) * this.scale,
      this.height / 2 - (y - this._middle[1]) * this.scale];
  }

  /**
   * Let a canvas be drawn on in metres, y upwards.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {number} density Pixels of the screen in one of the page.
   */
  apply(context, density) {
    const [x, y] = this.toScreen(0, 0);
    context.setTransform(
      density * this.scale, 0, 0, -density * this.scale, density * x, density * y);
  }

  /** @param {number} dx [m] @param {number} dy [m] */
  _move(dx, dy) {
    this._middle = [this._middle[0] + dx, this._middle[1] + dy];
    this._place();
  }

  /** Keep to what there is to see. */
  _place() {
    const {x0, y0, x1, y1} = this.box;
    const [wide, high] = [Math.max(x1 - x0, 0.5), Math.max(y1 - y0, 0.5)];
    this.scale = this._zoom * Math.min(
      Math.max(this.width - 2 * MARGIN, 1) / wide, Math.max(this.height - 2 * MARGIN, 1) / high);
    this._middle = [
      within(this._middle[0], x0, x1, this.width / this.scale),
      within(this._middle[1], y0, y1, this.height / this.scale)];
  }
}

/**
 * Return a middle such that what is seen stays within what there is.
 *
 * @param {number} middle
 * @param {number} low
 * @param {number} high
 * @param {number} seen
 * @returns {number}
 */
function within(middle, low, high, seen) {
  if (seen >= high - low) {
    return (low + high) / 2;
  }
  return Math.min(high - seen / 2, Math.max(low + seen / 2, middle));
}
