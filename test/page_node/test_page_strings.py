"""The words of the page: the same keys in four languages, and none that is asked for missing."""

import json
from pathlib import Path
import re

import pytest

from control_field.robot.collision_monitor import Intervention
from control_field.robot.stop_reasons import StopReason
from learner_node.session.phases import CODES

ROOT = Path(__file__).parents[2]
STATIC = ROOT / 'page_node' / 'static'
LANGUAGES = ('en', 'de', 'fr', 'es')
#: A key that is written out where it is asked for.
ASKED = re.compile(r"""\b(?:t|words)\(\s*'([a-z_]+\.[\w.]+)'""")
#: Codes as nodes write them, with what a name in braces may stand for.
ADVICE = re.compile(r"Advice\(\s*f?'([\w{}]+)'")
ANSWER = re.compile(r"(?:Answer|SessionError)\((?:[^()]|\([^()]*\))*?, '(\w+)'\)")
BRACES = {'{robot}': ('simulated', 'real'),
          '{outcome}': ('collision', 'gave_up', 'stopped', 'aborted')}
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


def written_out(code: str) -> set[str]:
    """Return the codes that one with names in braces stands for."""
    for name, values in BRACES.items():
        if name in code:
            return {each for value in values for each in written_out(code.replace(name, value))}
    return {code}


def test_every_code_of_the_nodes_has_words() -> None:
    """What advises, refuses, stops or holds is said in the words of the page."""
    advice = (ROOT / 'page_node' / 'view' / 'advice.py').read_text('utf-8')
    asked = {f'advice.{code}' for found in ADVICE.findall(advice) for code in written_out(found)}
    asked |= {f'stopped.{reason}' for reason in StopReason}
    asked |= {f'held.{each}' for each in Intervention if each.sentence}
    answers = ''.join(path.read_text('utf-8') for folder in (
        'msgs_bridge/teaching', 'learner_node/session') for path in (ROOT / folder).glob('*.py'))
    refused = {*ANSWER.findall(answers), *CODES.values()}
    assert len(asked) > 60
    assert len(refused) > 10
    known = {key.removesuffix('.other') for key in strings('en')}
    assert asked - known == set()
    assert {code for code in refused
            if not {f'refused.{code}', f'why.{code}', f'done.{code}'} & known} == set()
