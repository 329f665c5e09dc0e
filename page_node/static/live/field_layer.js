/** What changes seldom: ground, walls, arrows, prototypes. */

import {pixel} from './colours.js';

/** @typedef {import('../types.js').Field} Field */
/** @typedef {import('../types.js').Prototypes} Prototypes */
/** @typedef {import('../types.js').Truth} Truth */
/** @typedef {import('./colours.js').Colours} Colours */
/** @typedef {import('./viewport.js').Viewport} Viewport */

export const FLAGS = {centre: 1, demonstrated: 2, goal: 4, reached: 8, home: 16, heading: 32};

/** Arrows nearer to each other than this could not be told apart, [px]. */
const SPACING = 15;

/**
 * Return a picture of cells, one pixel each, the lowest row below.
 *
 * @param {number} rows
 * @param {number} cols
 * @param {(index: number) => number} pixelOf The pixel of a cell (`colours.js`); 0 for none.
 * @returns {HTMLCanvasElement}
 */
export function pictureOfCells(rows, cols, pixelOf) {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [cols, rows];
  const image = new ImageData(cols, rows);
  const pixels = new Uint32Array(image.data.buffer);
  for (let row = 0; row < rows; row += 1) {
    for (let col = 0; col < cols; col += 1) {
      pixels[(rows - 1 - row) * cols + col] = pixelOf(row * cols + col);
    }
  }
  canvas.getContext('2d')?.putImageData(image, 0, 0);
  return canvas;
}

/**
 * Return a picture of what is known of the ground: free, walls, doubted, and who gets home.
 *
 * @param {Field} field
 * @param {Colours} colours
 * @returns {HTMLCanvasElement}
 */
export function pictureOfGround({rows, cols, flags, known}, colours) {
  const [free, home, lost] = [pixel(colours.free), pixel(colours.home), pixel(colours.lost)];
  // The less a wall is believed in, the less it is seen.
  const walls = Array.from({length: 101}, (_, sure) => (
    pixel(colours.wall, 110 + Math.round(1.45 * sure))));
  const leadsSomewhere = flags.some(flag => flag & FLAGS.goal);
  return pictureOfCells(rows, cols, index => {
    const state = known[index] ?? -1;
    if (state) {
      return state < 0 ? 0 : walls[state] ?? 0;
    }
    return leadsSomewhere ? ((flags[index] ?? 0) & FLAGS.home ? home : lost) : free;
  });
}

/**
 * Return a faint picture of the true walls.
 *
 * @param {Truth} truth
 * @param {Colours} colours
 * @returns {HTMLCanvasElement}
 */
export function pictureOfTruth({rows, cols, occupancy}, colours) {
  const wall = pixel(colours.truth, 90);
  return pictureOfCells(rows, cols, index => (occupancy[index] ?? 0) > 50 ? wall : 0);
}

/**
 * Draw a picture of cells where they are.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {HTMLCanvasElement} picture
 * @param {{rows: number, cols: number, resolution: number, origin: [number, number]}} grid
 */
export function drawCells(context, picture, {rows, cols, resolution, origin}) {
  context.save();
  context.imageSmoothingEnabled = false;
  context.translate(origin[0], origin[1] + rows * resolution);
  context.scale(1, -1);
  context.drawImage(picture, 0, 0, cols * resolution, rows * resolution);
  context.restore();
}

/**
 * Draw how far the world goes, so that nobody takes its end for something unknown.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {Truth} truth
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawExtent(context, {rows, cols, resolution, origin}, viewport, colours) {
  const box = /** @type {const} */ ([...origin, cols * resolution, rows * resolution]);
  context.globalAlpha = 0.45;
  context.fillStyle = colours.free;
  context.fillRect(...box);
  context.globalAlpha = 1;
  context.strokeStyle = colours.truth;
  context.lineWidth = 1.5 / viewport.scale;
  context.strokeRect(...box);
}

/**
 * Draw which way to go, in as many cells as can be told apart.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {Field} field
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawArrows(context, field, viewport, colours) {
  const {rows, cols, resolution, origin} = field;
  const stride = Math.max(1, Math.ceil(SPACING / (resolution * viewport.scale)));
  const size = Math.min(stride * resolution * 0.3, 8 / viewport.scale);
  const [homeward, astray] = [new Path2D(), new Path2D()];
  for (let row = stride >> 1; row < rows; row += stride) {
    for (let col = stride >> 1; col < cols; col += stride) {
      const flags = field.flags[row * cols + col] ?? 0;
      if (flags & FLAGS.heading && (field.known[row * cols + col] ?? -1) === 0) {
        addArrow(flags & FLAGS.home ? homeward : astray, origin[0] + (col + 0.5) * resolution,
          origin[1] + (row + 0.5) * resolution,
          (field.angle[row * cols + col] ?? 0) * Math.PI / 128, size);
      }
    }
  }
  context.lineWidth = 1.3 / viewport.scale;
  context.lineCap = 'round';
  stroke(context, homeward, colours.arrow);
  stroke(context, astray, colours.warn);
}

/**
 * Draw what the field is made of: the directions that were shown, and those learnt by trying.
 *
 * @param {CanvasRenderingContext2D} context In metres, y upwards.
 * @param {Prototypes} prototypes
 * @param {number} resolution [m]
 * @param {Viewport} viewport
 * @param {Colours} colours
 */
export function drawPrototypes(context, prototypes, resolution, viewport, colours) {
  const size = Math.max(resolution * 0.36, 3.5 / viewport.scale);
  const paths = [new Path2D(), new Path2D()];
  for (let index = 0; index < prototypes.x.length; index += 1) {
    const path = paths[prototypes.demonstrated[index] ? 0 : 1];
    addArrow(/** @type {Path2D} */ (path), prototypes.x[index] ?? 0, prototypes.y[index] ?? 0,
      (prototypes.heading[index] ?? 0) * Math.PI / 4, size);
  }
  context.lineWidth = Math.min(Math.max(0.1 * resolution, 1.6 / viewport.scale),
    3 / viewport.scale);
  context.lineJoin = 'round';
  stroke(context, paths[0], colours.shown);
  stroke(context, paths[1], colours.learnt);
}

/** @param {CanvasRenderingContext2D} context @param {Path2D | undefined} path
 *  @param {string} colour */
function stroke(context, path, colour) {
  if (path) {
    context.strokeStyle = colour;
    context.stroke(path);
  }
}

/**
 * @param {Path2D} path
 * @param {number} x
 * @param {number} y
 * @param {number} angle
 * @param {number} size
 */
function addArrow(path, x, y, angle, size) {
  const [dx, dy] = [size * Math.cos(angle), size * Math.sin(angle)];
  path.moveTo(x - dx, y - dy);
  path.lineTo(x + dx, y + dy);
  path.moveTo(x + 0.1 * dx - 0.65 * dy, y + 0.1 * dy + 0.65 * dx);
  path.lineTo(x + dx, y + dy);
  path.lineTo(x + 0.1 * dx + 0.65 * dy, y + 0.1 * dy - 0.65 * dx);
}
