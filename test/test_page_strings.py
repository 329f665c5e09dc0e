"""The words of the page: the same keys in four languages, and none that is asked for missing."""

import json
from pathlib import Path
import re

import pytest

STATIC = Path(__file__).parents[1] / 'page_node' / 'static'
LANGUAGES = ('en', 'de', 'fr', 'es')
#: A key that is written out where it is asked for.
ASKED = re.compile(r"""\b(?:t|words)\(\s*'([a-z_]+\.[\w.]+)'""")
IN_HTML = re.compile(r'data-t(?:-label)?="([^"]+)"')


def strings(language: str) -> dict[str, str]:
    """Return the words of a language."""
    found = json.loads((STATIC / 'strings' / f'{language}.json').read_text('utf-8'))
    assert isinstance(found, dict)
    return found


@pytest.mark.parametrize('language', LANGUAGES[1:])
def test_every_language_has_words_for_the_same_keys(language: str) -> None:
    """What one says in English is said in the others, with the same values in it."""
    english, other = strings('en'), strings(language)
    assert set(other) == set(english)
    for key, text in english.items():
        assert set(re.findall(r'{\w+}', other[key])) == set(re.findall(r'{\w+}', text)), key


@pytest.mark.parametrize('language', LANGUAGES)
def test_keys_are_sorted_and_said_with_something(language: str) -> None:
    """A key is found where the alphabet says, and no text is empty."""
    found = strings(language)
    assert list(found) == sorted(found)
    assert all(text.strip() for text in found.values())


def test_every_key_that_is_asked_for_has_words() -> None:
    """A key that is misspelt would be shown instead of words."""
    asked = {key for path in STATIC.rglob('*.js') for key in ASKED.findall(path.read_text())}
    asked |= set(IN_HTML.findall((STATIC / 'index.html').read_text('utf-8')))
    known = strings('en')
    assert asked
    assert {key for key in asked if key not in known and f'{key}.other' not in known} == set()
