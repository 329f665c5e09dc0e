/** How changes of a field are painted: over the map, and in the small pictures of the film. */

import {pixel} from '../live/colours.js';
import {drawCells, pictureOfCells, pictureOfGround} from '../live/field_layer.js';
import {goalOf, KINDS} from './changes.js';

/** @typedef {import('../types.js').Field} Field */
/** @typedef {import('../types.js').Point} Point */
/** @typedef {import('../live/colours.js').Colours} Colours */
/** @typedef {import('./changes.js').Changes} Changes */

/** Colour of a change, by its name in the style sheet, and how much of the map it covers. */
/** @type {Record<import('./changes.js').Kind, [keyof Colours, number]>} */
const PAINT = {
  wall: ['near', 255], gained: ['good', 130], lost: ['warn', 150], turned: ['shown', 110],
  seen: ['arrow', 90],
};

/**
 * Return a picture of the cells that have changed.
 *
 * @param {Field} field
 * @param {Changes} changes
 * @param {Colours} colours
 * @returns {HTMLCanvasElement}
 */
export function pictureOfChanges({rows, cols}, {kinds}, colours) {
  const pixels = [0, ...KINDS.map(kind => {
    const [name, alpha] = PAINT[kind];
    return pixel(colours[name], alpha);
  })];
  return pictureOfCells(rows, cols, index => pixels[kinds[index] ?? 0] ?? 0);
}

/**
 * Paint a small picture: the ground, what has changed, the way and the goal.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {Field} field
 * @param {Changes} changes
 * @param {Point[]} way
 * @param {string} kind Of the episode.
 * @param {Colours} colours
 */
export function paintSmall(canvas, field, changes, way, kind, colours) {
  const context = canvas.getContext('2d');
  if (!context) {
    return;
  }
  const {rows, cols, resolution, origin} = field;
  const scale = Math.min(canvas.width / cols, canvas.height / rows) / resolution;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.fillStyle = colours.unknown;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.setTransform(
    scale, 0, 0, -scale, (canvas.width - cols * resolution * scale) / 2 - origin[0] * scale,
    (canvas.height + rows * resolution * scale) / 2 + origin[1] * scale);
  drawCells(context, pictureOfGround(field, colours), field);
  drawCells(context, pictureOfChanges(field, changes, colours), field);
  paintWay(context, way, kind === 'trial' ? colours.learnt : colours.way, 3 / scale);
  const goal = goalOf(field);
  if (goal) {
    context.beginPath();
    context.arc(...goal, 4.5 / scale, 0, 2 * Math.PI);
    context.fillStyle = colours.good;
    context.fill();
    context.strokeStyle = colours.surface;
    context.stroke();
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Point[]} way
 * @param {string} colour
 * @param {number} width [m]
 */
function paintWay(context, way, colour, width) {
  context.beginPath();
  for (const point of way) {
    context.lineTo(...point);
  }
  context.lineWidth = width;
  context.lineJoin = 'round';
  context.strokeStyle = colour;
  context.stroke();
}
