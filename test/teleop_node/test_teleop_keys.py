"""Keys: one at a time, whole or in pieces, and the Esc key told from what begins with it."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from teleop_node.driving import FACTORS, MOVES
from teleop_node.keys import (
    ACTIONS, ESCAPE, ESCAPE_TIME, HELP, KeyParser, OTHER, REPEAT_TIME, RepeatDetector)

SEQUENCES = ['\x1b[A', '\x1bOP', '\x1b[15~', '\x1b[1;5C', '\x1b[[B', '\x1b[202~', '\x1bx', 'ä',
             '€', '🙂']
ALONE = ['i', 'k', ' ', 'S', '\t', '\x7f']


def test_no_key_means_two_things():
    assert len({*MOVES, *FACTORS, *ACTIONS}) == len(MOVES) + len(FACTORS) + len(ACTIONS)


def test_the_help_names_every_key_and_fits_80_columns():
    for key in {*MOVES, *FACTORS, *ACTIONS} - {' ', ESCAPE}:
        assert f' {key} ' in HELP.replace('/', ' ').replace(',', ' , ').replace(':', ' ') + ' '
    assert 'Esc' in HELP
    assert 'space' in HELP
    assert max(map(len, HELP.splitlines())) < 80


@pytest.mark.parametrize('key', ALONE)
def test_a_letter_is_there_at_once(key):
    assert KeyParser().feed(key.encode(), 5.0) == [key]


def test_escape_is_a_key_when_nothing_follows():
    parser = KeyParser()
    assert parser.feed(b'\x1b', 1.0) == []
    assert parser.feed(b'', 1.0 + 0.9 * ESCAPE_TIME) == []
    assert parser.feed(b'', 1.0 + ESCAPE_TIME) == [ESCAPE]
    assert parser.feed(b'', 9.0) == []


@pytest.mark.parametrize('sequence', SEQUENCES)
def test_a_sequence_is_no_escape_key_and_no_letters(sequence):
    assert KeyParser().feed(sequence.encode(), 1.0) == [OTHER]


def test_escape_twice_is_pressed_twice():
    parser = KeyParser()
    assert parser.feed(b'\x1b\x1b', 1.0) == [ESCAPE]
    assert parser.feed(b'', 2.0) == [ESCAPE]


def test_a_sequence_that_never_ends_is_given_up():
    parser = KeyParser()
    assert parser.feed(b'\x1b[1;', 1.0) == []
    assert parser.feed(b'', 2.0) == [OTHER]
    assert parser.feed(b'i', 2.1) == ['i']


@given(st.lists(st.sampled_from(SEQUENCES + ALONE)), st.data())
def test_it_does_not_matter_how_the_bytes_are_cut(pressed, data):
    stream = ''.join(pressed).encode()
    whole = KeyParser().feed(stream, 1.0)
    assert whole == [key if key in ALONE else OTHER for key in pressed]
    parser, keys, rest = KeyParser(), [], stream
    while rest:
        n = data.draw(st.integers(1, len(rest)))
        keys += parser.feed(rest[:n], 1.0)
        rest = rest[n:]
    assert keys == whole


@given(st.lists(st.binary(max_size=20)))
def test_any_bytes_are_keys_in_the_end(pieces):
    parser, now, keys = KeyParser(), 0.0, []
    for piece in pieces:
        now += 0.01
        keys += parser.feed(piece, now)
    keys += parser.feed(b'', now + 1.0)
    assert bool(keys) == bool(b''.join(pieces))
    assert all(key == OTHER or (len(key) == 1 and ord(key) < 128) for key in keys)


def test_a_key_that_is_held_is_one_press():
    repeats = RepeatDetector()
    times = [1.0, 1.5, 1.53, 1.56, 1.56 + REPEAT_TIME - 0.01]
    new = [repeats.press('d', time).is_new for time in times]
    assert new == [True, False, False, False, False]
    assert repeats.press('d', times[-1] + REPEAT_TIME + 0.01).is_new
    assert repeats.press('n', times[-1] + REPEAT_TIME + 0.02).is_new
