/** A socket that comes back by itself, as soon as there is somebody to answer. */

/** First and longest wait before the next attempt, [ms]. */
const SOONEST = 250;
const LATEST = 4000;

/** @typedef {{open?: () => void, close?: () => void, message?: (data: any) => void}} Heard */

export class Socket {
  /**
   * @param {string} path Such as `/view`.
   * @param {Heard} heard What is done when it opens, closes, hears something.
   */
  constructor(path, heard) {
    const url = new URL(path, location.href);
    url.protocol = url.protocol.replace('http', 'ws');
    this._url = url;
    this._heard = heard;
    this._wait = SOONEST;
    /** @type {WebSocket | null} */
    this._socket = null;
    this._connect();
  }

  /** @returns {boolean} Whether somebody is there. */
  get isOpen() {
    return this._socket?.readyState === WebSocket.OPEN;
  }

  /** @returns {number} Bytes that have not left yet. */
  get backlog() {
    return this._socket?.bufferedAmount ?? 0;
  }

  /**
   * Send an object; nothing is kept for later.
   *
   * @param {object} message
   * @returns {boolean} Whether it is on its way.
   */
  send(message) {
    if (!this._socket || !this.isOpen) {
      return false;
    }
    this._socket.send(JSON.stringify(message));
    return true;
  }

  _connect() {
    const socket = new WebSocket(this._url);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      this._wait = SOONEST;
      this._heard.open?.();
    };
    socket.onmessage = ({data}) => this._heard.message?.(data);
    socket.onclose = () => this._again();
    this._socket = socket;
  }

  _again() {
    this._socket = null;
    this._heard.close?.();
    setTimeout(() => this._connect(), this._wait);
    this._wait = Math.min(2 * this._wait, LATEST);
  }
}
