/** The sentence on top: what goes on, and what to do next. */

import {element} from '../dom.js';

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Advice} Advice */

/** @param {Page} page @param {Advice} advice */
function wordsOf(page, {code, values = {}, because = '', details = ''}) {
  const why = because && page.words.has(because) ? ` ${page.t(because)}` : '';
  return {text: page.t(`advice.${code}`, values) + why, details};
}

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  let isOpen = false;
  let away = 'connecting';
  let told = '';
  const say = () => {
    const {text, details} = wordsOf(page, isOpen ? page.state.advice : {code: away});
    // Only what is new is written, or a screen reader says it again and again.
    if (told !== text + details) {
      told = text + details;
      root.replaceChildren(text, ...details ? [element('details', {},
        element('summary', {}, page.t('page.details')), details)] : []);
    }
  };
  page.on('connection', ({open}) => {
    isOpen = open;
    away = open ? 'away' : away;
    document.body.classList.toggle('away', !open);
    say();
  });
  page.on('state', say);
}
