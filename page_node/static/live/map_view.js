/**
 * A map on a canvas, for every room that shows one.
 *
 * `view.show('field', frame)` and so on; it draws itself when something has changed.
 */

import {onColours, readColours} from './colours.js';
import {drawArrows, drawCells, drawExtent, drawPrototypes, pictureOfGround, pictureOfTruth}
  from './field_layer.js';
import {drawDecision, drawGoal, drawMovers, drawRobot, drawSight, drawStart, Trail}
  from './moving_layer.js';
import {Viewport} from './viewport.js';

/** @typedef {import('../types.js').Point} Point */
/** @typedef {import('./viewport.js').Box} Box */

/** How much is seen around a robot that knows nothing yet, [m]. */
const AROUND = 2;
/** What the still picture is made of. */
const STILL = ['field', 'overlay', 'prototypes', 'truth', 'goal', 'start'];

export class MapView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.viewport = new Viewport();
    this.trail = new Trail();
    this.colours = readColours();
    /** Lets the robot glide between two frames. @type {import('./glide.js').Glide | null} */
    this.glide = null;
    /** Called when points have moved on the screen. @type {() => void} */
    this.onMoved = () => {};
    /** What is shown, by name. @type {Record<string, any>} */
    this._shown = {};
    /** Pictures of cells, by name. @type {Record<string, HTMLCanvasElement>} */
    this._pictures = {};
    /** Where something of the field is known. @type {Box | null} */
    this._seen = null;
    this._still = document.createElement('canvas');
    this._isStale = true;
    this._request = 0;
    this.nFrames = 0;
    new ResizeObserver(() => this._resize()).observe(canvas);
    onColours(() => this._recolour());
  }

  /**
   * Show something from now on; nothing of it where it is null.
   *
   * @param {'field' | 'overlay' | 'prototypes' | 'truth' | 'goal' | 'start' | 'sight' | 'robot' |
   *   'movers' | 'decision'} name `goal` is a point, `start` a pose, `decision` {row, col, heading},
   *   `overlay` a grid and the `picture` of its cells, the rest frames.
   * @param {any} what
   */
  show(name, what) {
    this._shown[name] = what;
    if (STILL.includes(name)) {
      this._isStale = true;
      this._paint(name);
    }
    this._fitBox();
    this.refresh();
  }

  /**
   * Show something that may be what is shown already.
   *
   * @param {'goal' | 'start' | 'decision'} name
   * @param {any} what
   */
  showIfNew(name, what) {
    if (JSON.stringify(what) !== JSON.stringify(this._shown[name] ?? null)) {
      this.show(name, what);
    }
  }

  /**
   * Show the way driven.
   *
   * @param {Point[]} points
   * @param {string} [kind] demo or trial; with it another way begins.
   */
  showTrail(points, kind) {
    if (kind === undefined) {
      this.trail.add(points);
    } else {
      this.trail.set(points, kind);
    }
    this.refresh();
  }

  /** See all of it, or more of it. @param {number} factor 0 for all. @param {...number} at [px] */
  zoom(factor, ...at) {
    if (factor) {
      this.viewport.zoom(factor, ...at);
    } else {
      this.viewport.fit();
    }
    this._moved();
  }

  /** @param {number} dx [px] @param {number} dy [px] */
  pan(dx, dy) {
    this.viewport.pan(dx, dy);
    this._moved();
  }

  /** Draw soon. */
  refresh() {
    this._request ||= requestAnimationFrame(() => {
      this._request = 0;
      this._draw();
    });
  }

  _moved() {
    this._isStale = true;
    this.onMoved();
    this.refresh();
  }

  _resize() {
    const {clientWidth, clientHeight} = this.canvas;
    const density = window.devicePixelRatio;
    for (const canvas of [this.canvas, this._still]) {
      canvas.width = Math.max(1, Math.round(clientWidth * density));
      canvas.height = Math.max(1, Math.round(clientHeight * density));
    }
    this.viewport.resize(clientWidth, clientHeight);
    this._moved();
    this._draw();
  }

  _recolour() {
    this.colours = readColours();
    STILL.forEach(name => this._paint(name));
    this._isStale = true;
    this.refresh();
  }

  /** @param {string} name Make the picture of cells anew. */
  _paint(name) {
    const what = this._shown[name];
    if (name === 'field' && what) {
      this._pictures.field = pictureOfGround(what, this.colours);
      const part = knownPart(what);
      this._seen = part.rows ? boxOf(part) : null;
    } else if (name === 'truth' && what) {
      this._pictures.truth = pictureOfTruth(what, this.colours);
    }
  }

  /** See to it that all there is can be seen. */
  _fitBox() {
    const {robot, field, truth, sight} = this._shown;
    const boxes = [truth && boxOf(truth), field && this._seen].filter(Boolean);
    if (robot) {
      const around = boxes.length ? 0.5 : AROUND;
      boxes.push({x0: robot.x - around, x1: robot.x + around,
        y0: robot.y - around, y1: robot.y + around});
    }
    if (sight && !boxes.length) {
      boxes.push(boxOf({...sight, origin: [sight.x0, sight.y0]}));
    }
    if (boxes.length) {
      const box = union(boxes);
      if (Object.entries(box).some(
        ([side, at]) => at !== this.viewport.box[/** @type {keyof Box} */ (side)])) {
        this.viewport.setBox(box);
        this._moved();
      }
    }
  }

  _draw() {
    const context = this.canvas.getContext('2d');
    if (!context || !this.canvas.clientWidth) {
      return;
    }
    if (this._isStale) {
      this._isStale = false;
      this._drawStill();
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this._still, 0, 0);
    this.viewport.apply(context, window.devicePixelRatio);
    this._drawMoving(context);
    this.nFrames += 1;
  }

  /** @param {import('./glide.js').Placed} robot Where to draw it now. */
  _glided(robot) {
    if (!this.glide) {
      return robot;
    }
    const [shown, moves] = this.glide.towards(robot, performance.now());
    if (moves) {
      this.refresh();
    }
    return shown;
  }

  _drawStill() {
    const context = this._still.getContext('2d');
    if (!context) {
      return;
    }
    const {field, overlay, prototypes, truth, goal, start} = this._shown;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = this.colours.unknown;
    context.fillRect(0, 0, this._still.width, this._still.height);
    this.viewport.apply(context, window.devicePixelRatio);
    this._drawGround(context, field, truth);
    if (overlay) {
      drawCells(context, overlay.picture, overlay);
    }
    if (field) {
      drawArrows(context, field, this.viewport, this.colours);
    }
    if (prototypes) {
      drawPrototypes(
        context, prototypes, field?.resolution ?? 0.25, this.viewport, this.colours);
    }
    if (start) {
      drawStart(context, start, this.viewport, this.colours);
    }
    if (goal) {
      drawGoal(context, goal, this.viewport, this.colours);
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {any} field @param {any} truth */
  _drawGround(context, field, truth) {
    if (truth) {
      drawExtent(context, truth, this.viewport, this.colours);
    }
    if (field && this._pictures.field) {
      drawCells(context, this._pictures.field, field);
    }
    if (truth && this._pictures.truth) {
      drawCells(context, this._pictures.truth, truth);
    }
  }

  /** @param {CanvasRenderingContext2D} context */
  _drawMoving(context) {
    const {sight, movers, robot, decision, field} = this._shown;
    if (sight) {
      drawSight(context, sight, this.viewport, this.colours);
    }
    this.trail.draw(context, this.viewport, this.colours);
    if (movers) {
      drawMovers(context, movers.discs, this.colours);
    }
    if (decision && field) {
      const centre = /** @type {Point} */ ([
        field.origin[0] + (decision.col + 0.5) * field.resolution,
        field.origin[1] + (decision.row + 0.5) * field.resolution]);
      drawDecision(
        context, centre, decision.heading, field.resolution, this.viewport, this.colours);
    }
    if (robot) {
      drawRobot(context, this._glided(robot), this.viewport, this.colours);
    }
  }
}

/**
 * Return the part of a field of which something is known: a workspace that fits itself has a wide
 * rim for what comes.
 *
 * @param {import('../types.js').Field} field
 * @returns {{rows: number, cols: number, resolution: number, origin: Point}}
 */
function knownPart({rows, cols, resolution, origin, known}) {
  const isKnown = /** @param {number} row @param {number} col */ (row, col) => (
    (known[row * cols + col] ?? -1) >= 0);
  const all = /** @param {number} n */ n => Array.from({length: n}, (_, at) => at);
  const seenRows = all(rows).filter(row => all(cols).some(col => isKnown(row, col)));
  const seenCols = all(cols).filter(col => seenRows.some(row => isKnown(row, col)));
  const row = seenRows[0] ?? 0;
  const col = seenCols[0] ?? 0;
  return {rows: seenRows.length && (seenRows.at(-1) ?? 0) - row + 1,
    cols: seenCols.length && (seenCols.at(-1) ?? 0) - col + 1, resolution,
    origin: [origin[0] + col * resolution, origin[1] + row * resolution]};
}

/**
 * @param {{rows: number, cols: number, resolution: number, origin: Point}} grid
 * @returns {Box}
 */
function boxOf({rows, cols, resolution, origin: [x0, y0]}) {
  return {x0, y0, x1: x0 + cols * resolution, y1: y0 + rows * resolution};
}

/** @param {Box[]} boxes @returns {Box} */
function union(boxes) {
  const all = /** @param {keyof Box} side */ side => boxes.map(box => box[side]);
  return {x0: Math.min(...all('x0')), y0: Math.min(...all('y0')),
    x1: Math.max(...all('x1')), y1: Math.max(...all('y1'))};
}
