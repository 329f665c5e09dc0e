/** A world that is being drawn: pixels, strokes, and taking them back. */

/** @typedef {import('../types.js').Point} Point */
/** @typedef {[number, number]} Pixel Row and column; row 0 is the lowest. */
/** @typedef {{row: number, col: number, rows: number, cols: number}} Patch */
/** @typedef {Patch & {before: Uint8Array, after: Uint8Array}} Stroke */
/** @typedef {{rows: number, cols: number, resolution: number, origin: Point}} Frame */

/** So many strokes can be taken back. */
const MOST_STROKES = 100;

export class Drawing {
  /**
   * @param {Frame} frame
   * @param {ArrayLike<number>} [occupancy] Row by row; what is not 0 is a wall.
   */
  constructor(frame, occupancy) {
    this.rows = frame.rows;
    this.cols = frame.cols;
    this.resolution = frame.resolution;
    this.origin = frame.origin;
    /** 1 where a wall is. */
    this.cells = new Uint8Array(frame.rows * frame.cols);
    for (let at = 0; at < (occupancy?.length ?? 0); at++) {
      this.cells[at] = Number(occupancy?.[at] !== 0);
    }
    /** Whether it differs from what it began with. */
    this.isChanged = false;
    /** Called with what has changed. @type {(patch: Patch) => void} */
    this.onChange = () => {};
    /** @type {Stroke[]} */
    this._done = [];
    /** @type {Stroke[]} */
    this._undone = [];
    /** @type {{before: Uint8Array, patch: Patch | null} | null} */
    this._open = null;
  }

  /** @returns {Patch} All of it. */
  get whole() {
    return {row: 0, col: 0, rows: this.rows, cols: this.cols};
  }

  /** @param {Point} place [m] @returns {Pixel} Perhaps outside. */
  pixelAt([x, y]) {
    return [Math.floor((y - this.origin[1]) / this.resolution),
      Math.floor((x - this.origin[0]) / this.resolution)];
  }

  /** @param {Pixel} pixel @returns {boolean} */
  contains([row, col]) {
    return row >= 0 && col >= 0 && row < this.rows && col < this.cols;
  }

  /** @param {Pixel} pixel @returns {boolean} */
  isWall([row, col]) {
    return this.cells[row * this.cols + col] === 1;
  }

  /** Begin a stroke: what follows is taken back at once. */
  begin() {
    this.end();
    this._open = {before: this.cells.slice(), patch: null};
  }

  /**
   * Draw from one pixel to another.
   *
   * @param {Pixel} from
   * @param {Pixel} to
   * @param {number} size Of the pen, [pixels].
   * @param {boolean} isWall
   */
  line([row0, col0], [row1, col1], size, isWall) {
    const n = Math.max(Math.abs(row1 - row0), Math.abs(col1 - col0), 1);
    for (let i = 0; i <= n; i++) {
      this.dab([Math.round(row0 + (row1 - row0) * i / n),
        Math.round(col0 + (col1 - col0) * i / n)], size, isWall);
    }
  }

  /**
   * Draw a square of so many pixels around one.
   *
   * @param {Pixel} pixel
   * @param {number} size
   * @param {boolean} isWall
   */
  dab([row, col], size, isWall) {
    const half = Math.floor((size - 1) / 2);
    const low = /** @param {number} at */ at => Math.max(0, at - half);
    const high = /** @param {number} at @param {number} most */ (at, most) => (
      Math.min(most, at - half + size));
    const patch = {row: low(row), col: low(col), rows: high(row, this.rows) - low(row),
      cols: high(col, this.cols) - low(col)};
    if (patch.rows <= 0 || patch.cols <= 0) {
      return;
    }
    for (let r = patch.row; r < patch.row + patch.rows; r++) {
      this.cells.fill(Number(isWall), r * this.cols + patch.col,
        r * this.cols + patch.col + patch.cols);
    }
    if (this._open) {
      this._open.patch = around(this._open.patch, patch);
    }
    this._changed(patch);
  }

  /** End a stroke. */
  end() {
    const {before, patch} = this._open ?? {before: null, patch: null};
    this._open = null;
    if (before && patch) {
      this._done.push({...patch, before: this._cut(before, patch),
        after: this._cut(this.cells, patch)});
      this._done.splice(0, this._done.length - MOST_STROKES);
      this._undone = [];
    }
  }

  /** Make all of it free, as one stroke. */
  clear() {
    this.begin();
    this.cells.fill(0);
    /** @type {NonNullable<typeof this._open>} */ (this._open).patch = this.whole;
    this._changed(this.whole);
    this.end();
  }

  /** @returns {boolean} */
  get canUndo() {
    return this._done.length > 0;
  }

  /** @returns {boolean} */
  get canRedo() {
    return this._undone.length > 0;
  }

  /** Take the last stroke back. */
  undo() {
    this.end();
    const stroke = this._done.pop();
    if (stroke) {
      this._undone.push(stroke);
      this._paste(stroke, stroke.before);
    }
  }

  /** Draw again what was taken back last. */
  redo() {
    const stroke = this._undone.pop();
    if (stroke) {
      this._done.push(stroke);
      this._paste(stroke, stroke.after);
    }
  }

  /** @param {Uint8Array} cells @param {Patch} patch @returns {Uint8Array} */
  _cut(cells, {row, col, rows, cols}) {
    const cut = new Uint8Array(rows * cols);
    for (let r = 0; r < rows; r++) {
      const from = (row + r) * this.cols + col;
      cut.set(cells.subarray(from, from + cols), r * cols);
    }
    return cut;
  }

  /** @param {Patch} patch @param {Uint8Array} cells */
  _paste({row, col, rows, cols}, cells) {
    for (let r = 0; r < rows; r++) {
      this.cells.set(cells.subarray(r * cols, (r + 1) * cols), (row + r) * this.cols + col);
    }
    this._changed({row, col, rows, cols});
  }

  /** @param {Patch} patch */
  _changed(patch) {
    this.isChanged = true;
    this.onChange(patch);
  }
}

/** @param {Patch | null} one @param {Patch} other @returns {Patch} What holds both. */
function around(one, other) {
  if (!one) {
    return other;
  }
  const row = Math.min(one.row, other.row);
  const col = Math.min(one.col, other.col);
  return {row, col, rows: Math.max(one.row + one.rows, other.row + other.rows) - row,
    cols: Math.max(one.col + one.cols, other.col + other.cols) - col};
}
