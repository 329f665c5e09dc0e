/** The sentence on top: what goes on, and what to do next. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Advice} Advice */

/** More letters than this are written smaller. */
const LONG = 80;

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  const told = element('p');
  const details = element('details', {class: 'details', hidden: true},
    element('summary', {}, page.t('page.details')), told);
  root.after(details);
  let isOpen = false;
  let away = 'connecting';
  const say = () => {
    const advice = isOpen ? page.state.advice : {code: away};
    write(root, wordsOf(page, advice));
    root.classList.toggle('long', (root.textContent ?? '').length > LONG);
    write(told, advice.details ?? '');
    details.hidden = !advice.details;
  };
  page.on('connection', ({open}) => {
    isOpen = open;
    away = open ? 'away' : away;
    document.body.classList.toggle('away', !open);
    say();
  });
  page.on('state', say);
}

/** @param {Page} page @param {Advice} advice @returns {string} */
function wordsOf({t, words}, {code, values = {}, because = ''}) {
  const said = t(`advice.${code}`, values);
  return because && words.has(because) ? `${said} ${t(because)}` : said;
}

/**
 * Write only what is new, or a screen reader says it again and again.
 *
 * @param {HTMLElement} place
 * @param {string} text
 */
function write(place, text) {
  if (place.textContent !== text) {
    place.textContent = text;
  }
}
