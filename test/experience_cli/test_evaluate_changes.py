"""`experience evaluate` in worlds that change and in which things move."""

import json

import pytest

from experience_cli.main import main

SIZE = 12
#: Rooms of 5 with a door in each of their walls, as MovingAI writes them.
PICTURE = """\
.....@......
.....@......
.....@......
............
.....@......
.....@......
@@.@@@@@@.@@
.....@......
.....@......
............
.....@......
.....@......
"""


@pytest.fixture
def world(tmp_path):
    path = tmp_path / 'rooms.map'
    path.write_text(f'type octile\nheight {SIZE}\nwidth {SIZE}\nmap\n{PICTURE}')
    return path


def run(world, *more):
    return main(['evaluate', '--world', str(world), '--goal', '8.5,8.5', '--demo-start', '1.5,1.5',
                 '--trials', '2', '--seeds', '2', *more])


def changed(world, *blocked):
    """Write a copy of a world in which some cells are blocked, and return its path."""
    head, picture = world.read_text().split('map\n')
    rows = [list(line) for line in picture.split()]
    for row, col in blocked:
        rows[SIZE - 1 - row][col] = '@'
    path = world.with_name(f'changed{len(blocked)}.map')
    path.write_text(f'{head}map\n' + '\n'.join(map(''.join, rows)) + '\n')
    return path


def test_a_world_that_changes_is_judged_as_it_is_then(world, tmp_path, capsys):
    shut = changed(world, (8, 8))
    assert run(world, '--trials', '3', '--change', f'1:{shut}', '--change', f'2:{world}', '--json',
               str(tmp_path / 'a.json')) == 0
    output, error = capsys.readouterr()
    assert f'1, now {shut}' in output
    assert error == (f'experience evaluate: after trial 1, {shut}: the goal is blocked there: '
                     f'nothing is judged until it is free again\n')
    report = json.loads((tmp_path / 'a.json').read_text())
    config, changes = report['config'], report['config']['changes']
    assert [(change['after'], change['world']) for change in changes] == [
        (1, str(shut)), (2, str(world))]
    assert [change['n_free'] - config['n_free'] for change in changes] == [-1, 0]
    assert [change['n_starts'] for change in changes] == [0, config['n_starts']]
    assert [entry['trials'] for entry in report['after']] == [0, 1, 2, 3]
    assert [(entry['trials'], entry['world']) for entry in report['at_changes']] == [
        (1, str(shut)), (2, str(world))]
    assert report['after'][2]['success']['median'] is None
    assert report['after'][3]['success']['median'] > 0.0


@pytest.mark.parametrize(('blocked', 'more', 'hint'), [
    ([(1, 1)], ['--starts', 'fixed'], 'blocks the start'),
    ([(row, col) for row in range(SIZE) for col in range(SIZE)], [], 'no free cell'),
])
def test_a_change_that_lets_no_trial_start_is_refused(world, blocked, more, hint, capsys):
    assert run(world, '--change', f'1:{changed(world, *blocked)}', *more) == 2
    assert hint in capsys.readouterr().err


def test_changes_come_in_the_order_of_their_trials(world, capsys):
    assert run(world, '--trials', '5', '--change', f'2:{world}', '--change', f'2:{world}') == 2
    assert 'in the order of their trials' in capsys.readouterr().err


def movers_file(folder, text):
    path = folder / 'movers.yaml'
    path.write_text(text)
    return str(path)


CROSSING = """
movers:
  - {radius: 0.4, speed: 0.5, mode: back_and_forth, waypoints: [[4.5, 1.0], [4.5, 11.0]]}
changes:
  - {at_trial: 2, close: [8.1, 8.1, 8.9, 8.9]}
  - {at_trial: 3, open: [8.1, 8.1, 8.9, 8.9]}
  - {at_trial: 9, close: [8.1, 8.1, 8.9, 8.9]}
"""


def test_what_moves_is_met_and_what_changes_at_a_trial_is_as_with_change(world, tmp_path, capsys):
    movers = movers_file(tmp_path, CROSSING)
    for name in 'ab':
        assert run(world, '--trials', '3', '--movers', movers, '--seeds', '1', '--json',
                   str(tmp_path / f'{name}.json')) == 0
    output, error = capsys.readouterr()
    assert 'mover_contacts' in output
    assert 'at trial 9, which there is not' in error
    assert 'the goal is blocked there' in error
    report, again = (json.loads((tmp_path / f'{name}.json').read_text()) for name in 'ab')
    assert report['config']['n_movers'] == 1
    assert [entry['trials'] for entry in report['at_changes']] == [1, 2]
    last = report['after'][-1]
    assert last['collisions']['values'] == [0.0]
    assert last['success']['median'] > 0.5
    for one, other in zip(report['after'], again['after'], strict=True):
        del one['seconds_learning'], other['seconds_learning']
        assert one == other


@pytest.mark.parametrize('method', ['dyna-q+', 'dyna_q++demo', 'forgetting-replanner'])
def test_methods_for_changing_worlds_have_names(world, method, capsys):
    assert run(world, '--method', method, '--trials', '0', '--json', '-') == 0
    assert json.loads(capsys.readouterr().out)['config']['method'] == method.replace('-', '_')


@pytest.mark.parametrize(('text', 'more', 'hint'), [
    ('movers: []', ['--method', 'replanner'], 'does not know things that move'),
    ('changes: [{at_trial: 2, close: [0, 0, 1, 1]}]', ['--change', '1:task1'],
     'name all changes in one place'),
    ('movers: [{radius: 0}]', [], 'entry 1 of movers'),
])
def test_movers_that_cannot_be_are_one_clear_line(world, tmp_path, text, more, hint, capsys):
    assert run(world, '--movers', movers_file(tmp_path, text), *more) == 2
    error = capsys.readouterr().err
    assert hint in error
    assert error.count('\n') == 1
