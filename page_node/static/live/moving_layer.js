/** What changes all the time: the way driven, what is seen, who moves, the robot. */

/** @typedef {import('../types.js').Robot} Robot */
/** @typedef {import('../types.js').Sight} Sight */
/** @typedef {import('../types.js').Point} Point */
/** @typedef {import('./colours.js').Colours} Colours */
/** @typedef {import('./viewport.js').Viewport} Viewport */

/** Nobody finds a robot that is drawn smaller than this, [px]. */
const SMALLEST = 8;

/**
 * Draw what the robot sees around it.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {Sight} sight
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawSight(context, {rows, cols, resolution, x0, y0, cells}, viewport, colours) {
  context.fillStyle = colours.near;
  context.globalAlpha = 0.6;
  for (let index = 0; index < cells.length; index += 1) {
    if ((cells[index] ?? 0) > 50) {
      context.fillRect(x0 + (index % cols) * resolution,
        y0 + Math.floor(index / cols) * resolution, resolution, resolution);
    }
  }
  context.globalAlpha = 0.45;
  context.strokeStyle = colours.robot;
  context.lineWidth = 1 / viewport.scale;
  context.setLineDash([4 / viewport.scale, 4 / viewport.scale]);
  context.strokeRect(x0, y0, cols * resolution, rows * resolution);
  context.setLineDash([]);
  context.globalAlpha = 1;
}

/** The way driven: it only grows until another begins. */
export class Trail {
  constructor() {
    this.kind = '';
    this.path = new Path2D();
    /** @type {Point | null} */
    this._last = null;
  }

  /** @param {Point[]} points @param {string} kind Begin anew. */
  set(points, kind) {
    this.kind = kind;
    this.path = new Path2D();
    this._last = null;
    this.add(points);
  }

  /** @param {Point[]} points */
  add(points) {
    for (const [x, y] of points) {
      this.path[this._last ? 'lineTo' : 'moveTo'](x, y);
      this._last = [x, y];
    }
  }

  /**
   * @param {CanvasRenderingContext2D} context In metres, y upwards.
   * @param {Viewport} viewport
   * @param {Colours} colours
   */
  draw(context, viewport, colours) {
    context.lineJoin = context.lineCap = 'round';
    context.strokeStyle = colours.surface;
    context.lineWidth = 6 / viewport.scale;
    context.globalAlpha = 0.7;
    context.stroke(this.path);
    context.globalAlpha = 1;
    context.strokeStyle = this.kind === 'trial' ? colours.learnt : colours.way;
    context.lineWidth = 3.5 / viewport.scale;
    context.stroke(this.path);
  }
}

/**
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {[number, number, number][]} discs
 * @param {Colours} colours
 */
export function drawMovers(context, discs, colours) {
  context.fillStyle = colours.warn;
  for (const [x, y, radius] of discs) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fill();
  }
}

/**
 * Draw the robot as a disc with an arrow where it looks.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {{x: number, y: number, yaw: number, radius?: number}} robot
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawRobot(context, {x, y, yaw, radius}, viewport, colours) {
  const size = Math.max(radius ?? 0, SMALLEST / viewport.scale);
  context.save();
  context.translate(x, y);
  context.rotate(yaw);
  context.beginPath();
  context.arc(0, 0, size, 0, 2 * Math.PI);
  context.fillStyle = colours.robot;
  context.fill();
  context.lineWidth = 2 / viewport.scale;
  context.strokeStyle = colours.surface;
  context.stroke();
  context.beginPath();
  context.moveTo(0.7 * size, 0);
  context.lineTo(-0.45 * size, 0.5 * size);
  context.lineTo(-0.2 * size, 0);
  context.lineTo(-0.45 * size, -0.5 * size);
  context.fillStyle = colours.surface;
  context.fill();
  context.restore();
}

/**
 * Draw the goal as a target.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {Point} goal
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawGoal(context, [x, y], viewport, colours) {
  const rings = [[11, colours.surface], [9, colours.good], [6, colours.surface],
    [3, colours.good]];
  for (const [size, colour] of /** @type {[number, string][]} */ (rings)) {
    context.beginPath();
    context.arc(x, y, size / viewport.scale, 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
  }
}

/**
 * Draw where trials start: a ring, open where the robot looks.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {[number, number, number]} start
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawStart(context, [x, y, yaw], viewport, colours) {
  context.beginPath();
  context.arc(x, y, 10 / viewport.scale, yaw + 0.6, yaw - 0.6 + 2 * Math.PI);
  context.strokeStyle = colours.accent;
  context.lineWidth = 2.5 / viewport.scale;
  context.stroke();
}

/**
 * Draw what the robot has decided: from a cell, one way.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {Point} from
 * @param {number} heading 0 to 7.
 * @param {number} resolution [m]
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawDecision(context, [x, y], heading, resolution, viewport, colours) {
  const angle = heading * Math.PI / 4;
  const length = resolution * (heading % 2 ? Math.SQRT2 : 1);
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + length * Math.cos(angle), y + length * Math.sin(angle));
  context.strokeStyle = colours.near;
  context.lineWidth = 3 / viewport.scale;
  context.stroke();
}
