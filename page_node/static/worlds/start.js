/** Begin another world: an empty one, or a map that somebody brings. */

import {element} from '../dom.js';
import {Drawing} from './drawing.js';
import {KINDS, uploadFromFiles} from './upload.js';

/** @typedef {import('../page.js').Page} Page */

/** Sides of the squares of a new world, [m]; the first is a robot's cell. */
const SQUARES = [0.25, 0.1, 0.05];
const LONGEST = 4096;

/**
 * Make the form for an empty world.
 *
 * @param {Page} page
 * @param {(drawing: Drawing) => void} begin
 * @returns {HTMLElement}
 */
export function makeNew(page, begin) {
  const width = number(page, 'width', 5, 0.5, 200);
  const height = number(page, 'height', 5, 0.5, 200);
  const square = element('select', {}, ...SQUARES.map(side => (
    element('option', {value: side}, page.t('worlds.metres', {n: side})))));
  const form = element('form', {class: 'fields', onsubmit: event => {
    event.preventDefault();
    const resolution = Number(square.value);
    const count = /** @param {HTMLInputElement} input */ input => (
      Math.min(LONGEST, Math.max(1, Math.round(input.valueAsNumber / resolution))));
    begin(new Drawing({rows: count(height.input), cols: count(width.input), resolution,
      origin: [0, 0]}));
    folded.open = false;
  }}, width.label, height.label,
  element('label', {}, page.t('worlds.square'), square),
  element('button', {type: 'submit'}, page.t('worlds.begin')));
  const folded = fold(page, 'new', form);
  return folded;
}

/**
 * Make the form for a map that somebody brings.
 *
 * @param {Page} page
 * @param {(name: string, body: Blob) => Promise<boolean>} send Returns whether it was taken.
 * @returns {{root: HTMLElement, take: (files: File[]) => Promise<void>}}
 */
export function makeBring(page, send) {
  const files = element('input', {type: 'file', multiple: true, accept: KINDS});
  const side = number(page, 'resolution', 0.05, 0.005, 10, 'any');
  const take = /** @param {File[]} chosen */ async chosen => {
    const upload = await uploadFromFiles(chosen, side.input.valueAsNumber);
    if (!upload) {
      page.say(page.t('worlds.no.image'));
    } else if (await send(upload.name, upload.body)) {
      files.value = '';
      folded.open = false;
    }
  };
  const form = element('form', {class: 'fields', onsubmit: event => {
    event.preventDefault();
    void take([...files.files ?? []]);
  }}, element('label', {}, page.t('worlds.files'), files), side.label,
  element('p', {}, page.t('worlds.files_help')),
  element('button', {type: 'submit'}, page.t('worlds.take')));
  const folded = fold(page, 'bring', form);
  return {root: folded, take};
}

/**
 * @param {Page} page
 * @param {string} name
 * @param {number} value
 * @param {number} min
 * @param {number} max
 * @param {number | string} [step]
 */
function number(page, name, value, min, max, step = 0.05) {
  const input = element('input', {type: 'number', value, min, max, step, required: true,
    inputmode: 'decimal'});
  return {input, label: element('label', {}, page.t(`worlds.${name}`), input)};
}

/** @param {Page} page @param {string} name @param {HTMLElement} content */
function fold(page, name, content) {
  return element('details', {class: 'fold'},
    element('summary', {}, page.t(`worlds.${name}`)), content);
}
