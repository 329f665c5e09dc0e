/** The sentence on top: what goes on, and what to do next. */

/** @typedef {import('../page.js').Page} Page */

/**
 * @param {HTMLElement} root
 * @param {Page} page
 */
export function mount(root, page) {
  let isOpen = false;
  let away = 'connecting';
  const say = () => {
    const {code, values} = isOpen ? page.state.advice : {code: away, values: {}};
    const text = page.t(`advice.${code}`, values);
    // Only what is new is written, or a screen reader says it again and again.
    if (root.textContent !== text) {
      root.textContent = text;
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
