"""`kitchen/0002`, as `list` prints it, is understood by every command that takes a bag."""

import json

import pytest

from experience_cli.main import main

NAMES = ['sample/0001', 'sample/1', 'sample/0001_demo', 'bags/sample/0001', 'bags/sample/1',
         'bags/sample/0001_demo']
COMMANDS = ['list {}', 'show {}', 'explain {} --at 1', 'inspect {} --out out.png',
            'learn sample/1 {} --quiet', 'repair {}', 'diff sample {} --out out.png',
            'label {} success', 'forget {}', 'forget --undo {}']


@pytest.mark.parametrize('command', COMMANDS)
def test_every_command_takes_the_names_that_list_prints(task, command, capsys):
    told = json.loads(_out(capsys, 'list', '--json'))[1]['bag']
    if '--undo' in command:
        assert main(['forget', told]) == 0
    code = main(command.format(told).split())
    assert code == 0, capsys.readouterr().err


@pytest.mark.parametrize('name', NAMES)
def test_every_way_to_write_it_is_the_same_bag(task, name, capsys):
    assert json.loads(_out(capsys, 'list', '--json', name))[0]['path'].endswith(
        'bags/sample/0001_demo')
    assert 'bags/sample/0001_demo: whole' in _out(capsys, 'repair', name)
    assert main(['learn', '--quiet', name]) == 0


@pytest.mark.parametrize('name', ['sample', 'bags/sample'])
def test_a_task_has_a_name_too(task, name, capsys):
    assert len(json.loads(_out(capsys, 'list', '--json', name))) == 3
    assert _out(capsys, 'repair', name).count('whole') == 3


@pytest.mark.parametrize(('name', 'words'), [
    ('sample/0009', 'there is no bag 0009'), ('sample/0001_trial', 'is a demo, no trial'),
    ('nowhere/0001', 'nowhere/0001'), ('nowhere', 'nowhere')])
@pytest.mark.parametrize('command', ['list', 'learn', 'inspect', 'repair'])
def test_what_is_not_there_is_one_line(task, command, name, words, capsys):
    assert main([command, name]) == 2
    line, = capsys.readouterr().err.splitlines()
    assert words in line


def test_a_forgotten_one_comes_back_by_its_name_or_as_the_last_of_its_task(task, capsys):
    for number in (1, 3):
        assert main(['forget', f'sample/{number}']) == 0
    assert main(['learn', 'sample/1']) == 2
    assert 'experience forget --undo sample/1' in capsys.readouterr().err
    assert 'sample/0003 is back in bags/sample' in _out(capsys, 'forget', '--undo', 'sample')
    assert 'sample/0001 is back in bags/sample' in _out(capsys, 'forget', '--undo', 'sample/0001')
    assert main(['forget', '--undo', 'sample']) == 2
    assert 'nothing was taken away' in capsys.readouterr().err


def _out(capsys, *words):
    capsys.readouterr()
    assert main(list(words)) == 0
    return capsys.readouterr().out
