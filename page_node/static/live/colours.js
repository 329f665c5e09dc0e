/** The colours of the map: those of the style sheet, light or dark. */

/** @typedef {Record<'unknown' | 'free' | 'wall' | 'home' | 'lost' | 'arrow' | 'shown' | 'learnt' |
 *   'way' | 'robot' | 'truth' | 'near' | 'surface' | 'text' | 'warn' | 'good' | 'accent',
 *   string>} Colours */

const NAMES = ['unknown', 'free', 'wall', 'home', 'lost', 'arrow', 'shown', 'learnt', 'way',
  'robot', 'truth', 'near', 'surface', 'text', 'warn', 'good', 'accent'];

/** @returns {Colours} */
export function readColours() {
  const style = getComputedStyle(document.documentElement);
  return /** @type {Colours} */ (Object.fromEntries(
    NAMES.map(name => [name, style.getPropertyValue(`--${name}`).trim()])));
}

/** @param {() => void} listener Called when light becomes dark. */
export function onColours(listener) {
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', listener);
}

/**
 * Return a colour such as `#1f2f3f` as a pixel of an `ImageData`.
 *
 * @param {string} colour
 * @param {number} [alpha] 0 to 255.
 * @returns {number}
 */
export function pixel(colour, alpha = 255) {
  const value = parseInt(colour.slice(1), 16);
  const bytes = new Uint8Array([value >> 16, (value >> 8) & 255, value & 255, alpha]);
  return new Uint32Array(bytes.buffer)[0] ?? 0;
}
