"""Commands that only read open a bag that was cut, say what is missing, and leave it as it is."""

import pytest

from experience_cli.main import main
from sample_helpers import files_of, FIRST

READING = [('show', FIRST), ('explain', FIRST, '--at', '1'), ('learn', 'bags/sample'),
           ('learn', '--quiet', 'bags/sample/0002_trial', 'bags/sample/0001_demo'),
           ('inspect', 'bags/sample', '--out', 'out.png')]


def cut(task, n):
    path = task.find(2).bag
    path.write_bytes(path.read_bytes()[:-n])


@pytest.mark.parametrize('words', READING)
@pytest.mark.parametrize('n', [1, 8, 100, 4096, 20_000, 150_000])
def test_it_is_read_and_said_in_one_line_what_is_missing(task, capsys, words, n):
    assert main(words) == 0
    assert capsys.readouterr().err == ''
    cut(task, n)
    files = files_of(task.root)
    assert main(words) == 0
    said = capsys.readouterr()
    [line] = said.err.splitlines()
    assert line.startswith(f'experience {words[0]}: ')
    assert '0002_trial was not closed: ' in line
    assert 'bags/sample/0002_trial` mends it' in line
    assert ('no message is missing' in line) == (n <= 4096)
    assert 'messages can be read' in line
    if n == 150_000:
        assert ' of ' in line.partition('; ')[2]
    assert said.out
    assert files_of(task.root) == files


def test_once_mended_nothing_is_said_any_more(task, capsys):
    cut(task, 20_000)
    assert main(['learn', 'bags/sample']) == 0
    taught = capsys.readouterr()
    words = taught.err.split('`')[1].split()
    assert main(words[1:]) == 0
    assert 'mended' in capsys.readouterr().out
    assert main(['learn', 'bags/sample']) == 0
    again = capsys.readouterr()
    assert (again.out, again.err) == (taught.out, '')


def test_of_a_bag_that_is_being_recorded_it_is_not_said_that_it_is_to_be_mended(task, capsys):
    cut(task, 20_000)
    task.hold()
    assert main(['show', FIRST]) == 0
    line = capsys.readouterr().err
    assert 'it is being recorded or changed just now' in line
    assert 'repair' not in line


@pytest.mark.parametrize('words', READING[:2])
def test_where_nothing_is_left_that_is_the_one_line(task, capsys, words):
    path = task.find(2).bag
    path.write_bytes(path.read_bytes()[:40])
    assert main(words) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert 'cut off so early that no message is left' in line or 'is empty' in line
