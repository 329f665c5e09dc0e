/** Worlds on their way to the server: drawn cells, an image, the two files of map_server. */

/** @typedef {import('./drawing.js').Drawing} Drawing */

/** What is read of a map that somebody brings. */
export const KINDS = '.png,.pgm,.jpg,.jpeg,.bmp,.yaml,.yml';

/**
 * Put a big frame of bytes together, see `binary.js`.
 *
 * @param {Record<string, any>} header
 * @param {Record<string, {bytes: Uint8Array, shape: number[]}>} arrays
 * @returns {Blob}
 */
export function frameOf(header, arrays) {
  const columns = Object.entries(arrays).map(([name, {shape}]) => ({name, dtype: 'u1', shape}));
  let text = JSON.stringify({...header, arrays: columns});
  text += ' '.repeat((4 - new TextEncoder().encode(text).length % 4) % 4);
  const encoded = new TextEncoder().encode(text);
  const length = new DataView(new ArrayBuffer(4));
  length.setUint32(0, encoded.length, true);
  return new Blob([length.buffer, encoded,
    ...Object.values(arrays).map(({bytes}) => /** @type {BlobPart} */ (bytes))]);
}

/** @param {Drawing} drawing @returns {Blob} */
export function frameFromDrawing({rows, cols, resolution, origin, cells}) {
  return frameOf({type: 'drawn', resolution, origin}, {cells: {bytes: cells, shape: [rows, cols]}});
}

/**
 * Return what is sent of files that somebody has chosen; null if there is no image among them.
 *
 * @param {File[]} files
 * @param {number} resolution Metres a pixel, where no YAML file says it.
 * @returns {Promise<{name: string, body: Blob} | null>}
 */
export async function uploadFromFiles(files, resolution) {
  const yaml = files.find(file => isYaml(file.name));
  const image = files.find(file => !isYaml(file.name));
  if (!image) {
    return null;
  }
  const bytes = new Uint8Array(await image.arrayBuffer());
  const arrays = {image: {bytes, shape: [bytes.length]}};
  return {name: nameFrom((yaml ?? image).name.replace(/\.\w+$/, '')), body: yaml
    ? frameOf({type: 'map_server', yaml: await yaml.text()}, arrays)
    : frameOf({type: 'image', resolution}, arrays)};
}

/** @param {string} name @returns {boolean} */
export function isYaml(name) {
  return /\.ya?ml$/i.test(name);
}

/**
 * Return what a file may be called of what somebody calls it.
 *
 * @param {string} text
 * @returns {string} Perhaps empty.
 */
export function nameFrom(text) {
  return text.replaceAll('ß', 'ss').normalize('NFKD').replace(/\p{M}/gu, '')
    .replace(/[^A-Za-z0-9_-]+/g, '_').replace(/^[_-]+|[_-]+$/g, '').slice(0, 64);
}

/**
 * Return a name that is not taken: `hall`, `hall-2`, `hall-3` ...
 *
 * @param {string} name
 * @param {Iterable<string>} taken
 * @returns {string}
 */
export function freeName(name, taken) {
  const known = new Set(taken);
  const stem = name.replace(/-\d+$/, '').slice(0, 58) || 'world';
  let free = name || stem;
  for (let n = 2; known.has(free); n++) {
    free = `${stem}-${n}`;
  }
  return free;
}
