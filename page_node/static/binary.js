/** Big frames: a JSON header, then the arrays that it names, back to back. */

/** @typedef {Uint8Array | Int8Array | Uint16Array | Int32Array | Float32Array} Numbers */
/** @typedef {{name: string, dtype: string, shape: number[]}} Column */
/** @typedef {Record<string, any> & {type: string}} Frame */

const KINDS = /** @type {Record<string, any>} */ ({
  u1: Uint8Array, i1: Int8Array, u2: Uint16Array, i4: Int32Array, f4: Float32Array,
});

/**
 * Return the header of a big frame with its arrays, by name, beside its other values.
 *
 * @param {ArrayBuffer} buffer
 * @returns {Frame}
 */
export function frameFromBytes(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const {arrays, ...frame} = header;
  let offset = 4 + length;
  for (const column of /** @type {Column[]} */ (arrays)) {
    const size = column.shape.reduce((product, side) => product * side, 1);
    frame[column.name] = numbers(buffer, offset, column.dtype, size);
    offset += frame[column.name].byteLength;
  }
  return frame;
}

/**
 * @param {ArrayBuffer} buffer
 * @param {number} offset
 * @param {string} dtype
 * @param {number} size
 * @returns {Numbers}
 */
function numbers(buffer, offset, dtype, size) {
  const kind = KINDS[dtype];
  if (!kind) {
    throw new Error(`a frame has an array of type ${dtype}`);
  }
  if (offset % kind.BYTES_PER_ELEMENT === 0) {
    return new kind(buffer, offset, size);
  }
  // An array of bytes before this one may have ended anywhere.
  return new kind(buffer.slice(offset, offset + size * kind.BYTES_PER_ELEMENT));
}
