"""Tables and progress: on a terminal, and for a program that reads on."""

import io

import pytest

from experience_cli.terminal import Progress, table_lines
from msgs_bridge.untrusted.text import SafeStream


class Terminal(io.StringIO):
    """A terminal that keeps what it is sent."""

    def isatty(self):
        """Return that it is one."""
        return True

    @property
    def seen(self):
        """Return the lines as a person sees them: what is behind a carriage return overwrites."""
        lines = []
        for line in self.getvalue().split('\n'):
            shown = ''
            for part in line.split('\r'):
                shown = part + shown[len(part):]
            lines.append(shown.rstrip())
        return lines


def test_columns_are_as_wide_as_their_widest_cell():
    assert table_lines([('bag', 'size'), ('a/0001', '9'), ('b', '120')], right=(1,)) == [
        'bag     size', 'a/0001     9', 'b        120']


def test_a_row_ends_with_its_last_letter_and_a_table_may_have_a_title_only():
    assert table_lines([('one', 'two')]) == ['one  two']
    assert table_lines([('one', 'two'), ('x', '')]) == ['one  two', 'x']


def test_a_cell_cannot_send_codes_to_the_terminal():
    assert table_lines([('\x1b[2J\n',), ('a',)]) == ['\\x1b[2J\\n', 'a']


def test_rows_of_several_lengths_are_a_mistake():
    with pytest.raises(ValueError, match='zip'):
        table_lines([('a', 'b'), ('c',)])


def test_for_a_program_only_what_stays_is_written():
    stream = io.StringIO()
    with Progress('task1', stream) as progress:
        assert not progress.is_live
        progress.show('starting')
        progress.keep('trial 1: goal')
        progress.show('trial 2')
    assert stream.getvalue() == 'task1: trial 1: goal\n'


def test_on_a_terminal_the_line_that_changes_gives_way_and_is_gone_in_the_end():
    stream = Terminal()
    with Progress('task1', stream) as progress:
        assert progress.is_live
        progress.show('trial 1: step 7')
        assert stream.seen == ['task1: trial 1: step 7']
        progress.keep('trial 1: goal')
        assert stream.seen == ['task1: trial 1: goal', '']
    assert stream.seen == ['task1: trial 1: goal', '']


def test_what_comes_too_soon_after_the_line_before_is_left_out():
    stream = Terminal()
    with Progress('task1', stream) as progress:
        for step in range(1000):
            progress.show(f'step {step}')
        assert 'step 999' not in stream.getvalue()


def test_codes_in_what_is_shown_do_not_reach_the_terminal():
    stream = Terminal()
    with Progress('task1', SafeStream(stream)) as progress:
        progress.show('\x1b]0;owned\x07')
        progress.keep('\x1b]0;owned\x07')
    assert '\x1b]' not in stream.getvalue()
    assert '\\x1b]0;owned' in stream.getvalue()
