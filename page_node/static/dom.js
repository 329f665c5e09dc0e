/** Elements made in one line, so that no panel writes HTML as text. */

/** @typedef {Node | string | null | undefined | false} Child */
/** @typedef {Record<string, string | number | boolean | null | undefined |
 *    ((event: any) => void)>} Attributes */

/**
 * Make an element.
 *
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Attributes} [attributes] `onclick` and the like are listeners; false and null are left
 *   out, true is written without a value.
 * @param {...Child} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    set(made, name, value);
  }
  made.append(...children.filter(isShown));
  return made;
}

/**
 * Make the picture of a button: one path, 24 x 24, in the colour of the text.
 *
 * @param {string} path
 * @returns {SVGSVGElement}
 */
export function icon(path) {
  const space = 'http://www.w3.org/2000/svg';
  const svg = document.createElementNS(space, 'svg');
  const line = document.createElementNS(space, 'path');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('aria-hidden', 'true');
  svg.classList.add('icon');
  line.setAttribute('d', path);
  svg.append(line);
  return svg;
}

/**
 * Write words into what asks for them: `data-t` is text, `data-t-label` the accessible name.
 *
 * @param {ParentNode} root
 * @param {(key: string) => string} t
 */
export function translate(root, t) {
  for (const found of root.querySelectorAll('[data-t]')) {
    found.textContent = t(found.getAttribute('data-t') ?? '');
  }
  for (const found of root.querySelectorAll('[data-t-label]')) {
    found.setAttribute('aria-label', t(found.getAttribute('data-t-label') ?? ''));
  }
}

/**
 * @param {Element} made
 * @param {string} name
 * @param {Attributes[string]} value
 */
function set(made, name, value) {
  if (typeof value === 'function') {
    made.addEventListener(name.slice(2), value);
  } else if (value !== false && value !== null && value !== undefined) {
    made.setAttribute(name, value === true ? '' : String(value));
  }
}

/**
 * @param {Child} child
 * @returns {child is Node | string}
 */
function isShown(child) {
  return child !== null && child !== undefined && child !== false;
}
