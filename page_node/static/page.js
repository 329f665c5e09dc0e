/** What every room of the page shares: what the server tells, what it is asked for, words. */

import {frameFromBytes} from './binary.js';
import {element} from './dom.js';
import {Socket} from './socket.js';
import {UNKNOWN_STATE} from './types.js';

/** @typedef {import('./types.js').State} State */
/** @typedef {import('./types.js').Answer} Answer */
/** @typedef {import('./i18n.js').Words} Words */
/** @typedef {import('./i18n.js').Values} Values */
/** @typedef {import('./drive/drive.js').Drive} Drive */
/** @typedef {(frame: any) => void} Listener */

/** Refusals of which the node knows more than their words; the others speak of keys. */
const DETAILED = ['bags', 'conflict', 'disk', 'implausible', 'leads_nowhere', 'malformed', 'no_robot',
  'not_learnt', 'not_set', 'outside', 'refused', 'too_short'];
/** How long what was said once can be read, [ms]. */
const SAID = 7000;

export class Page {
  /** @param {Words} words */
  constructor(words) {
    this.words = words;
    this.t = words.t.bind(words);
    this.state = UNKNOWN_STATE;
    this.room = 'teach';
    /** @type {Drive} */
    this.drive = /** @type {any} */ (null);
    /** @type {Map<string, any>} */
    this._last = new Map();
    /** @type {Map<string, Set<Listener>>} */
    this._listeners = new Map();
    this._seen = 0;
    this._forgetting = 0;
  }

  /** Begin to hear what the server tells. */
  connect() {
    this._view = new Socket('/view', {
      open: () => {
        this._seen = 0;
        this.tell({type: 'connection', open: true});
      },
      close: () => this.tell({type: 'connection', open: false}),
      message: data => this._hear(data),
    });
  }

  /**
   * Call a function with each frame of a type, and at once with the last one there was.
   *
   * Beside the server's there are `connection` {open}, `room` {name} and `driver` {who}.
   *
   * @param {string} type
   * @param {Listener} listener
   * @returns {() => void} Stops it.
   */
  on(type, listener) {
    const off = this.next(type, listener);
    if (this._last.has(type)) {
      listener(this._last.get(type));
    }
    return off;
  }

  /**
   * Call a function with each frame of a type that comes from now on.
   *
   * @param {string} type
   * @param {Listener} listener
   * @returns {() => void} Stops it.
   */
  next(type, listener) {
    const listeners = this._listeners.get(type) ?? new Set();
    this._listeners.set(type, listeners);
    listeners.add(listener);
    return () => listeners.delete(listener);
  }

  /** @param {{type: string} & Record<string, any>} frame Tell whoever wants to know. */
  tell(frame) {
    this._last.set(frame.type, frame);
    if (frame.type === 'state') {
      this.state = /** @type {State} */ (/** @type {unknown} */ (frame));
    }
    this._listeners.get(frame.type)?.forEach(listener => listener(frame));
  }

  /**
   * Ask for an action, and say what came of it.
   *
   * @param {string} action Such as `keep`.
   * @param {object} [body]
   * @returns {Promise<Answer>}
   */
  async act(action, body = {}) {
    const answer = await this.post(`/api/actions/${action}`, body);
    this.sayAnswer(action, answer);
    return answer;
  }

  /** @param {string} action @param {Answer} answer Say what came of it. */
  sayAnswer(action, {success, code = '', message, values}) {
    // What the sentence on top says at once anyway has no words here.
    const keys = success ? [`done.${code}`, `done.${action}`]
      : [`refused.${code}`, `why.${code}`, 'refused.unknown'];
    const words = keys.find(key => this.words.has(key)) ?? '';
    const knowsMore = !success && (DETAILED.includes(code) || words === 'refused.unknown');
    this.say(words && this.t(words, values), knowsMore ? message : '', success ? action : '');
  }

  /**
   * Send JSON or bytes; a server that is gone is an answer, too.
   *
   * @param {string} path
   * @param {object | Blob | ArrayBuffer} body
   * @returns {Promise<Answer & Record<string, any>>}
   */
  async post(path, body) {
    const isRaw = body instanceof Blob || body instanceof ArrayBuffer;
    try {
      const response = await fetch(path, {
        method: 'POST', body: isRaw ? body : JSON.stringify(body),
        headers: {'Content-Type': isRaw ? 'application/octet-stream' : 'application/json'},
      });
      return {success: response.ok, message: '', ...await response.json()};
    } catch {
      return {success: false, code: 'no_connection', message: ''};
    }
  }

  /**
   * Load JSON.
   *
   * @param {string} path
   * @param {AbortSignal} [signal]
   * @returns {Promise<any>}
   */
  async json(path, signal) {
    return (await this._load(path, signal)).json();
  }

  /**
   * Load a big frame.
   *
   * @param {string} path
   * @param {AbortSignal} [signal]
   * @returns {Promise<import('./binary.js').Frame>}
   */
  async binary(path, signal) {
    return frameFromBytes(await (await this._load(path, signal)).arrayBuffer());
  }

  /**
   * Say something once, below the sentence on top.
   *
   * @param {string} text
   * @param {string} [details] In the words of whoever refused, for those who want to know.
   * @param {string} [done] The action that has been done.
   */
  say(text, details = '', done = '') {
    const place = document.getElementById('notice');
    place?.setAttribute('data-done', done);
    place?.replaceChildren(text, details && text ? element('details', {},
      element('summary', {}, this.t('page.details')), details) : '');
    clearTimeout(this._forgetting);
    this._forgetting = setTimeout(() => {
      if (!place?.querySelector('[open]')) {
        place?.replaceChildren();
      }
    }, SAID);
  }

  /** @param {string} path @param {AbortSignal} [signal] */
  async _load(path, signal) {
    const response = await fetch(path, signal ? {signal} : {});
    if (!response.ok) {
      throw new Error(`${path}: ${response.status}`);
    }
    return response;
  }

  /** @param {string | ArrayBuffer} data */
  _hear(data) {
    const frames = typeof data === 'string' ? JSON.parse(data) : [frameFromBytes(data)];
    this._seen += 1;
    this._view?.send({seen: this._seen});
    for (const frame of frames) {
      this.tell(frame);
    }
  }
}
