"""Text from elsewhere shows its codes instead of sending them."""

import io
import sys
import unicodedata

from hypothesis import given
from hypothesis import strategies as st
import pytest

from msgs_bridge.untrusted.text import (
    own_stream, printable, printable_lines, safe_output, SafeStream)

SENT = {
    '\x1b[2J': r'\x1b[2J', '\x1b]0;title\x07': r'\x1b]0;title\x07', '\x9b31m': r'\x9b31m',
    'a\nb': r'a\nb', 'a\rb': r'a\rb', 'a\x00': r'a\x00', '\x7f': r'\x7f', 'a\u202eb': r'a\u202eb',
    '\u2066': r'\u2066', 'a\u2028b': r'a\u2028b', '\u200b': r'\u200b', '\ufeff': r'\ufeff',
    'odom\udcff': r'odom\udcff', '\ud800': r'\ud800', '\U000e0041': r'\U000e0041'}


@pytest.mark.parametrize('text', SENT)
def test_codes_are_shown(text):
    assert printable(text) == SENT[text]


@pytest.mark.parametrize('text', ['', '/odom', 'Küche', '台所', 'a\xa0b', '🤖', "it's 5 °C, \\n"])
def test_plain_text_stays(text):
    assert printable(text) == printable_lines(text) == text


@given(st.text(st.characters()), st.integers(0, 50))
def test_nothing_that_a_terminal_obeys_is_left(text, limit):
    shown = printable(text, limit)
    assert all(unicodedata.category(each) not in ('Cc', 'Cf', 'Cs', 'Zl', 'Zp') for each in shown)
    assert len(shown) <= 10 * limit
    assert printable(shown) == shown


def test_long_text_is_cut():
    assert printable('a' * 10, 10) == 'a' * 10
    assert printable('a' * 11, 10) == 'aaaaaaa...'
    assert len(printable('a' * 10**6)) == 2000


def test_errors_and_numbers_are_text_too():
    assert printable(ValueError('a\nb')) == r'a\nb'
    assert printable(1.5) == '1.5'


def test_tables_keep_their_lines():
    assert printable_lines('a\tb\nc\x1b[31m\n') == 'a\tb\nc\\x1b[31m\n'


def test_what_is_printed_comes_through_a_safe_stream(capsys):
    with safe_output(), safe_output():
        print('name \x1b[2J\u202e', 1)
        print('wrong \x07', file=sys.stderr)
        sys.stdout.writelines(['\x1b', '\n'])
        own_stream(sys.stdout).write('\r\x1b[K')
    print('\x1b')
    out, err = capsys.readouterr()
    assert out == 'name \\x1b[2J\\u202e 1\n\\x1b\n\r\x1b[K\x1b\n'
    assert err == 'wrong \\x07\n'


def test_a_safe_stream_does_all_else_as_the_stream():
    stream = io.StringIO()
    safe = SafeStream(stream)
    assert safe.write('\x1b') == 1
    safe.flush()
    assert not safe.isatty()
    assert own_stream(stream) is own_stream(safe) is stream
    assert safe == stream
    assert stream == safe
    assert safe != io.StringIO()
    assert len({safe, stream}) == 1
