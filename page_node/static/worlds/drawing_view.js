/** A drawing on a canvas, with the robot in it and the pen that keys move. */

import {onColours, pixel, readColours} from '../live/colours.js';
import {Viewport} from '../live/viewport.js';
import {Drawing} from './drawing.js';

/** @typedef {import('./drawing.js').Patch} Patch */
/** @typedef {import('./drawing.js').Pixel} Pixel */

/** Squares that are smaller on the screen get no lines between them, [px]. */
const LEAST_SQUARE = 7;

export class DrawingView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.viewport = new Viewport();
    this.drawing = new Drawing({rows: 1, cols: 1, resolution: 1, origin: [0, 0]});
    /** The robot; null where it is in another world. @type {any} */
    this.robot = null;
    /** Where the pen of the keys is. @type {{pixel: Pixel, size: number} | null} */
    this.cursor = null;
    this._picture = document.createElement('canvas');
    this._colours = readColours();
    this._request = 0;
    new ResizeObserver(() => this._resize()).observe(canvas);
    onColours(() => {
      this._colours = readColours();
      this._paint(this.drawing.whole);
    });
  }

  /** @param {Drawing} drawing Show another one. */
  show(drawing) {
    this.drawing = drawing;
    this._picture.width = drawing.cols;
    this._picture.height = drawing.rows;
    const [x0, y0] = drawing.origin;
    this.viewport.fit();
    this.viewport.setBox({x0, y0, x1: x0 + drawing.cols * drawing.resolution,
      y1: y0 + drawing.rows * drawing.resolution});
    drawing.onChange = patch => this._paint(patch);
    this._paint(drawing.whole);
  }

  /** @param {number} x [px] @param {number} y [px] @returns {Pixel} Perhaps outside. */
  pixelAt(x, y) {
    return this.drawing.pixelAt(this.viewport.toWorld(x, y));
  }

  /** See all of it, or more of it. @param {number} factor 0 for all. @param {...number} at [px] */
  zoom(factor, ...at) {
    if (factor) {
      this.viewport.zoom(factor, ...at);
    } else {
      this.viewport.fit();
    }
    this.refresh();
  }

  /** @param {number} dx [px] @param {number} dy [px] */
  pan(dx, dy) {
    this.viewport.pan(dx, dy);
    this.refresh();
  }

  /** Draw soon. */
  refresh() {
    this._request ||= requestAnimationFrame(() => {
      this._request = 0;
      this._draw();
    });
  }

  _resize() {
    const {clientWidth, clientHeight} = this.canvas;
    this.canvas.width = Math.max(1, Math.round(clientWidth * devicePixelRatio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * devicePixelRatio));
    this.viewport.resize(clientWidth, clientHeight);
    this._draw();
  }

  /** @param {Patch} patch Paint some pixels anew; the picture has its first row on top. */
  _paint({row, col, rows, cols}) {
    const {cells, cols: stride, rows: all} = this.drawing;
    const image = new ImageData(cols, rows);
    const pixels = new Uint32Array(image.data.buffer);
    const [free, wall] = [pixel(this._colours.free), pixel(this._colours.wall)];
    for (let r = 0; r < rows; r++) {
      const from = (row + r) * stride + col;
      const to = (rows - 1 - r) * cols;
      for (let c = 0; c < cols; c++) {
        pixels[to + c] = cells[from + c] ? wall : free;
      }
    }
    this._picture.getContext('2d')?.putImageData(image, col, all - row - rows);
    this.refresh();
  }

  _draw() {
    const context = this.canvas.getContext('2d');
    if (!context) {
      return;
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = this._colours.unknown;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.viewport.apply(context, devicePixelRatio);
    this._drawPixels(context);
    this._drawLines(context);
    this._drawRobot(context);
    this._drawCursor(context);
  }

  /** @param {CanvasRenderingContext2D} context */
  _drawPixels(context) {
    const {origin: [x, y], resolution, rows, cols} = this.drawing;
    context.save();
    context.imageSmoothingEnabled = resolution * this.viewport.scale < 1;
    context.translate(x, y + rows * resolution);
    context.scale(resolution, -resolution);
    context.drawImage(this._picture, 0, 0);
    context.restore();
    context.strokeStyle = this._colours.wall;
    context.lineWidth = 3 / this.viewport.scale;
    context.strokeRect(x, y, cols * resolution, rows * resolution);
  }

  /** @param {CanvasRenderingContext2D} context */
  _drawLines(context) {
    const {origin: [x, y], resolution, rows, cols} = this.drawing;
    if (resolution * this.viewport.scale < LEAST_SQUARE) {
      return;
    }
    context.beginPath();
    for (let col = 1; col < cols; col++) {
      context.moveTo(x + col * resolution, y);
      context.lineTo(x + col * resolution, y + rows * resolution);
    }
    for (let row = 1; row < rows; row++) {
      context.moveTo(x, y + row * resolution);
      context.lineTo(x + cols * resolution, y + row * resolution);
    }
    context.strokeStyle = this._colours.unknown;
    context.lineWidth = 1 / this.viewport.scale;
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context */
  _drawRobot(context) {
    if (!this.robot) {
      return;
    }
    const {x, y, yaw, radius} = this.robot;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = this._colours.accent;
    context.fill();
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + radius * Math.cos(yaw), y + radius * Math.sin(yaw));
    context.strokeStyle = this._colours.surface;
    context.lineWidth = 2 / this.viewport.scale;
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context */
  _drawCursor(context) {
    if (!this.cursor) {
      return;
    }
    const {pixel: [row, col], size} = this.cursor;
    const {origin: [x, y], resolution} = this.drawing;
    const half = Math.floor((size - 1) / 2);
    context.strokeStyle = this._colours.near;
    context.lineWidth = 3 / this.viewport.scale;
    context.strokeRect(x + (col - half) * resolution, y + (row - half) * resolution,
      size * resolution, size * resolution);
  }
}
