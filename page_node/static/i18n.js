/** The words of the page, one file a language; numbers as its readers write them. */

export const LANGUAGES = /** @type {const} */ ({
  en: 'English', de: 'Deutsch', fr: 'Français', es: 'Español',
});

/** @typedef {keyof typeof LANGUAGES} Language */
/** @typedef {Record<string, string | number>} Values */

const STORED = 'language';

/**
 * Return the language to speak: the one chosen here before, else the first the browser wants.
 *
 * @returns {Language}
 */
export function preferredLanguage() {
  const wanted = [localStorage.getItem(STORED), ...navigator.languages];
  for (const tag of wanted) {
    const language = (tag ?? '').slice(0, 2).toLowerCase();
    if (language in LANGUAGES) {
      return /** @type {Language} */ (language);
    }
  }
  return 'en';
}

/** @param {string} language Speak it from now on. */
export function chooseLanguage(language) {
  localStorage.setItem(STORED, language);
  location.reload();
}

/**
 * Load the words of a language.
 *
 * @param {Language} language
 * @returns {Promise<Words>}
 */
export async function loadWords(language) {
  const answer = await fetch(new URL(`strings/${language}.json`, import.meta.url));
  return new Words(language, await answer.json());
}

/** Says things in one language. */
export class Words {
  /**
   * @param {Language} language
   * @param {Record<string, string>} strings
   */
  constructor(language, strings) {
    this.language = language;
    this._strings = strings;
    this._plural = new Intl.PluralRules(language);
  }

  /** @param {string} key @returns {boolean} Whether there are words for a key. */
  has(key) {
    return Object.hasOwn(this._strings, key) || Object.hasOwn(this._strings, `${key}.other`);
  }

  /**
   * Return the words for a key, with `{name}` filled in.
   *
   * Where there is `key.one` beside `key.other` the value `n` chooses between them.
   *
   * @param {string} key
   * @param {Values} [values]
   * @returns {string}
   */
  t(key, values = {}) {
    const text = this._strings[key] ?? this._counted(key, Number(values.n ?? 0)) ?? key;
    return text.replace(/\{(\w+)\}/g, (all, name) => (
      Object.hasOwn(values, name) ? this._written(values[name] ?? '') : all));
  }

  /**
   * Write a number.
   *
   * @param {number} value
   * @param {number} [digits] After the point, at most.
   * @returns {string}
   */
  number(value, digits = 0) {
    return new Intl.NumberFormat(
      this.language, {maximumFractionDigits: digits}).format(value);
  }

  /**
   * Write a share in percent; what is not all of it is never rounded up to 100 %.
   *
   * @param {number} value
   * @returns {string}
   */
  share(value) {
    return new Intl.NumberFormat(this.language, {style: 'percent'}).format(
      Math.floor(100 * value + 1e-9) / 100);
  }

  /** @param {string} key @param {number} n @returns {string | undefined} */
  _counted(key, n) {
    return this._strings[`${key}.${this._plural.select(n)}`] ?? this._strings[`${key}.other`];
  }

  /** @param {string | number} value @returns {string} */
  _written(value) {
    return typeof value === 'number' ? this.number(value, 2) : value;
  }
}
