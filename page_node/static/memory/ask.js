/** Asks the memory; what is refused has a code that there are words for. */

import {frameFromBytes} from '../binary.js';

/** @typedef {import('../page.js').Page} Page */

/**
 * A row of the list; `page_node/memory/rows.py` says what each is.
 *
 * @typedef {object} Row
 * @property {string} name Such as `task1/0003`.
 * @property {number} number
 * @property {number} count Which drive or which try it is, from 1.
 * @property {'demo' | 'trial'} kind
 * @property {boolean} forgotten
 * @property {string} state
 * @property {string | null} [began]
 * @property {number | null} [seconds]
 * @property {string} [outcome]
 * @property {string} [label]
 * @property {boolean} [learnt]
 * @property {number | null} [steps]
 * @property {number | null} [reinforcements]
 * @property {string} [stop_reason]
 * @property {string} [damage]
 * @property {string} [note]
 * @property {string} [version]
 *
 * @typedef {{task: string, tasks: string[], episodes: Row[], complete: boolean,
 *   others: string[]}} Rows
 */

/** Why something is not shown. */
export class Refused extends Error {
  /** @param {string} code @param {string} message In the memory's own words. */
  constructor(code, message) {
    super(message);
    this.code = code;
  }
}

/**
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @returns {Promise<any>}
 */
export async function askJson(path, signal) {
  return (await load(path, signal)).json();
}

/**
 * @param {string} path
 * @param {AbortSignal} [signal]
 * @returns {Promise<import('../binary.js').Frame>}
 */
export async function askFrame(path, signal) {
  return frameFromBytes(await (await load(path, signal)).arrayBuffer());
}

/**
 * Return where something of a bag is; a bag that changes is another address.
 *
 * @param {Row} row
 * @param {string} what
 * @param {number} [at] [s]
 * @returns {string}
 */
export function pathOf(row, what, at) {
  const query = new URLSearchParams();
  if (at !== undefined) {
    query.set('at', at.toFixed(3));
  }
  if (row.version) {
    query.set('v', row.version);
  }
  return `/api/episodes/${row.name}/${what}?${query}`;
}

/**
 * Return the words for what was refused, with the memory's own beside them.
 *
 * @param {Page} page
 * @param {unknown} error
 * @returns {{text: string, details: string}}
 */
export function wordsFor(page, error) {
  const {code, message} = error instanceof Refused ? error : new Refused('', String(error));
  const key = `memory.refused.${code}`;
  return {text: page.t(page.words.has(key) ? key : 'memory.refused.other'), details: message};
}

/** @param {string} path @param {AbortSignal} [signal] @returns {Promise<Response>} */
async function load(path, signal) {
  let response;
  try {
    response = await fetch(path, signal ? {signal} : {});
  } catch (error) {
    throw signal?.aborted ? error : new Refused('no_connection', String(error));
  }
  if (!response.ok) {
    const {code, message} = await response.json().catch(() => ({code: '', message: ''}));
    throw new Refused(String(code), String(message));
  }
  return response;
}
