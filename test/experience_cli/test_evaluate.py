"""`experience evaluate` from the outside: its files, its numbers, its refusals."""

import json

import numpy as np
from PIL import Image
import pytest

from experience_cli.main import main
from experience_evaluation.experiment import run_seed
from experience_evaluation.workers import LostError
from experience_evaluation.worlds import generate
from ros_helpers import ROOT

SIZE = 12


@pytest.fixture
def world(tmp_path):
    return written(tmp_path, 'rooms', 3)


def written(folder, family, seed):
    occupancy = generate(family, SIZE, seed)
    rows = [''.join('.' if cell == 0 else '@' for cell in row) for row in occupancy[::-1]]
    path = folder / f'{family}.map'
    path.write_text(f'type octile\nheight {SIZE}\nwidth {SIZE}\nmap\n' + '\n'.join(rows) + '\n')
    return path


def run(world, *more, goal='8.5,8.5', start='1.5,1.5'):
    return main(['evaluate', '--world', str(world), '--goal', goal, '--demo-start', start,
                 '--trials', '2', '--seeds', '2', *more])


STEPS = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]


def step(free, cell, heading):
    row, col = cell[0] + STEPS[heading][0], cell[1] + STEPS[heading][1]
    inside = 0 <= row < SIZE and 0 <= col < SIZE
    beside = inside and free[row, col] and free[cell[0], col] and free[row, cell[1]]
    return (row, col) if beside else None


def cells_of(mask):
    return [(int(row), int(col)) for row, col in np.argwhere(mask)]


def least_costs(free, goal):
    """Bellman and Ford: slow and plainly right."""
    cost = {goal: 0.0}
    for _ in range(free.size):
        for cell in cells_of(free):
            for heading in range(8):
                after = step(free, cell, heading)
                if after in cost:
                    length = cost[after] + np.hypot(*STEPS[heading])
                    cost[cell] = min(cost.get(cell, np.inf), length)
    return cost


def follow(free, headings, goal, cell):
    """Return the headings taken to the goal, None if it is not reached."""
    taken, seen = [], set()
    while cell != goal:
        if cell is None or cell in seen:
            return None
        seen.add(cell)
        taken.append(headings[cell])
        cell = step(free, cell, headings[cell])
    return taken


def numbers_from_outside(world, field):
    """Work the numbers out as the document says, with nothing of ours."""
    lines = world.read_text().splitlines()[4:][::-1]
    free = np.array([[mark == '.' for mark in line] for line in lines])
    headings = np.floor(np.arctan2(field['vy'], field['vx']) / (np.pi / 4) + 0.5).astype(int) % 8
    x, y = field['goal']
    goal = (int(y), int(x))
    cost = least_costs(free, goal)
    assert sorted(cost) == cells_of(field['reachable'])
    home = {cell: follow(free, headings, goal, cell) for cell in cost}
    lengths = {cell: sum(np.hypot(*STEPS[heading]) for heading in taken)
               for cell, taken in home.items() if taken is not None}
    allowed = field['known'] != 100
    known = [cell for cell in least_costs(allowed, goal) if field['known'][cell] == 0]
    basin = [follow(allowed, headings, goal, cell) is not None for cell in known]
    shown = [headings[cell] == field['shown'][cell] for cell in cells_of(field['shown'] >= 0)
             if field['known'][cell] != 100 and step(allowed, cell, field['shown'][cell])]
    return {
        'field_success': len(lengths) / len(cost),
        'field_success_spl': sum(cost[cell] / length if length else 1.0
                                 for cell, length in lengths.items()) / len(cost),
        'hidden_neurons': len(field['centres']),
        'hidden_neurons_share': len(field['centres']) / len(cost),
        'basin': np.mean(basin), 'fidelity': np.mean(shown),
        'flow_steps': n_steps(home[1, 1]),
        'greedy_steps': n_steps(follow(free, field['q_matrix'].argmax(axis=2), goal, (1, 1)))}


def n_steps(taken):
    """Return the number of steps; None where they do not lead to the goal."""
    return None if taken is None else len(taken)


@pytest.mark.parametrize(('family', 'seed', 'more'), [
    ('rooms', 3, ()), ('random', 1, ('--set', 'unknown_is_blocked=true'))])
def test_anybody_can_check_the_numbers_from_the_field_file(
    tmp_path, capsys, family, seed, more,
):
    world = written(tmp_path, family, seed)
    assert run(world, *more, '--json', str(tmp_path / 'a.json'),
               '--save-field', str(tmp_path / 'field.npz')) == 0
    assert 'field_success' in capsys.readouterr().out
    report = json.loads((tmp_path / 'a.json').read_text())
    field = np.load(tmp_path / 'field.npz')
    last = report['after'][-1]
    for name, value in numbers_from_outside(world, field).items():
        assert last[name]['values'][0] == pytest.approx(value), name


@pytest.mark.parametrize(('method', 'count'), [
    ('q_learning+demo', lambda field: (field['q_matrix'] != 0).any(axis=2).sum()),
    ('dyna_q', lambda field: (field['q_matrix'] != 0).any(axis=2).sum()),
    ('nearest_prototype', lambda field: (field['shown'] >= 0).sum()),
    ('replanner', lambda field: 0)])
def test_the_size_of_other_methods_can_be_counted_in_the_field_file_too(
    world, tmp_path, method, count,
):
    assert run(world, '--method', method, '--json', str(tmp_path / 'a.json'),
               '--save-field', str(tmp_path / 'field.npz')) == 0
    last = json.loads((tmp_path / 'a.json').read_text())['after'][-1]
    field = np.load(tmp_path / 'field.npz')
    assert len(field['centres']) == 0
    assert last['hidden_neurons']['values'][0] == count(field)
    if method != 'replanner':
        assert last['basin']['values'][0] is None
        assert (field['known'] == -1).all()
    assert last['greedy_steps']['values'] == last['flow_steps']['values']


def test_report_has_an_entry_for_every_number_of_trials(world, tmp_path):
    assert run(world, '--json', str(tmp_path / 'a.json'), '--profile', 'paper') == 0
    report = json.loads((tmp_path / 'a.json').read_text())
    assert [entry['trials'] for entry in report['after']] == [0, 1, 2]
    assert report['config']['goal'] == [8.5, 8.5]
    assert report['config']['profile'] == 'paper'
    for entry in report['after']:
        for name, metric in entry.items():
            if name != 'trials' and metric['median'] is not None:
                assert metric['low'] <= metric['median'] <= metric['high']


def test_judging_now_and_then_changes_no_number(world, tmp_path):
    for every in ('1', '2', '5'):
        assert run(world, '--trials', '3', '--judge-every', every, '--json',
                   str(tmp_path / f'{every}.json')) == 0
    reports = {every: json.loads((tmp_path / f'{every}.json').read_text()) for every in '125'}
    each = {entry['trials']: entry for entry in reports['1']['after']}
    assert [entry['trials'] for entry in reports['2']['after']] == [0, 2, 3]
    assert [entry['trials'] for entry in reports['5']['after']] == [0, 3]
    for entry in reports['2']['after'] + reports['5']['after']:
        for name in set(entry) - {'seconds_learning', 'trials'}:
            assert entry[name] == each[entry['trials']][name], name


def test_results_do_not_depend_on_the_number_of_jobs(world, tmp_path):
    for jobs in ('1', '2'):
        assert run(world, '--json', str(tmp_path / f'{jobs}.json'), '--jobs', jobs,
                   '--save-field', str(tmp_path / f'{jobs}.npz')) == 0
    one, two = (json.loads((tmp_path / f'{jobs}.json').read_text()) for jobs in '12')
    for entry in one['after'] + two['after']:
        del entry['seconds_learning']
    assert one == two
    assert (tmp_path / '1.npz').read_bytes() == (tmp_path / '2.npz').read_bytes()


def test_what_is_finished_is_reported_and_lost_seeds_are_named(world, monkeypatch, capsys):
    def lose_the_second(tasks, n_jobs, title):
        raise LostError([1], [run_seed(*tasks[0])])

    monkeypatch.setattr('experience_cli.commands.evaluate.run_all', lose_the_second)
    assert run(world, '--seed0', '7', '--json', '-') == 1
    output, error = capsys.readouterr()
    config = json.loads(output)['config']
    assert (config['seeds'], config['lost_seeds']) == ([7], [8])
    assert 'without the seeds 8' in error


def test_field_file_holds_prototypes_as_they_act(world, tmp_path):
    assert run(world, '--save-field', str(tmp_path / 'field.npz')) == 0
    field = np.load(tmp_path / 'field.npz')
    rows, cols = (field['centres'][:, ::-1] - 0.5).astype(int).T
    np.testing.assert_allclose(
        np.stack([field['vx'][rows, cols], field['vy'][rows, cols]], axis=1), field['actions'],
        atol=1e-6)
    np.testing.assert_allclose(np.hypot(*field['actions'].T), 1.0)
    assert field['q'].shape == field['weights'].shape == (len(rows),)


@pytest.mark.parametrize('start', ['-2.5,-1.5', '-.5,-1.5'])
def test_negative_coordinates_are_taken_as_coordinates(tmp_path, start, capsys):
    (tmp_path / 'a.pgm').write_bytes(b'P5\n8 8\n255\n' + bytes([254]) * 64)
    (tmp_path / 'a.yaml').write_text(
        'image: a.pgm\nresolution: 1.0\norigin: [-4.0, -4.0, 0.0]\nnegate: 0\n'
        'occupied_thresh: 0.65\nfree_thresh: 0.25\n')
    for arguments in (['--goal', '-3.5,2.5', '--demo-start', start],
                      ['--goal=-3.5,2.5', f'--demo-start={start}']):
        assert main(['evaluate', '--world', str(tmp_path / 'a.yaml'), *arguments, '--trials', '0',
                     '--seeds', '1', '--json', '-']) == 0
        report = json.loads(capsys.readouterr().out)
        assert report['config']['goal'] == [-3.5, 2.5]
        assert report['after'][0]['field_success']['median'] == 1.0


@pytest.mark.parametrize(('arguments', 'hint'), [
    (['--goal', '99,1'], 'outside'),
    (['--demo-start', '8.5,8.5'], 'goal itself'),
    (['--json', '/nowhere/a.json'], 'no folder'),
    (['--save-field', '/'], 'folder'),
    (['--json', '/dev/full'], 'cannot be written'),
    (['--json', 'a', '--save-field', './a'], 'two files'),
    (['--method', 'magic'], 'no such method'),
    (['--set', 'caution=much'], 'float'),
    (['--set', 'moves=5'], '4 or 8'),
    (['--set', 'nothing'], 'NAME=VALUE'),
    (['--set', 'seed=3'], '--seed0'),
    (['--set', 'profile=full'], '--profile'),
    (['--goal', '1e308,0'], 'outside'),
    (['--demo-steps', '20', '--teacher', 'blind'], '--demo-steps'),
    (['--demo-bag', '/nowhere/bag'], 'no such bag'),
    (['--demo-steps', '3'], 'no way of 3 steps'),
    (['--world', '/nowhere/a.map'], 'no such file'),
    (['--change', '1:/nowhere/b.map'], '--change 1:/nowhere/b.map: there is no such file'),
    (['--change', '2:dyna'], 'no trial 3'),
    (['--change', '1:dyna'], '6 x 9 cells of 1 m'),
])
def test_a_mistake_is_one_clear_line(world, arguments, hint, capsys):
    assert run(world, *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith('experience evaluate: ')
    assert hint in error
    assert error.count('\n') == 1


@pytest.mark.parametrize('option', ['--json', '--save-field'])
def test_the_world_is_not_written_over(world, option, capsys):
    before = world.read_bytes()
    assert run(world, option, str(world)) == 2
    assert 'is the world itself' in capsys.readouterr().err
    assert world.read_bytes() == before


def test_what_was_made_do_with_in_a_map_is_said(tmp_path, capsys):
    pixels = np.full((12, 12), 254, dtype=np.uint8)
    pixels[0, 0] = 205
    Image.fromarray(pixels).save(tmp_path / 'map.png')
    world = tmp_path / 'map.yaml'
    world.write_text('image: map.png\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\n'
                     'occupied_thresh: 0.65\nfree_thresh: 0.25\n')
    assert run(world, '--trials', '0', '--seeds', '1') == 0
    said = capsys.readouterr().err
    assert f'experience evaluate: --world {tmp_path}/map.png: 1 cell that' in said


def test_a_far_place_where_cells_are_small_lies_outside(tmp_path, capsys):
    (tmp_path / 'a.pgm').write_bytes(b'P5\n8 8\n255\n' + b'\xfe' * 64)
    (tmp_path / 'a.yaml').write_text('image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n')
    assert run(tmp_path / 'a.yaml', goal='1e308,0', start='0.01,0.01') == 2
    assert 'outside' in capsys.readouterr().err


def test_a_drive_from_another_world_is_refused(tmp_path, capsys):
    path = tmp_path / 'row.map'
    path.write_text('type octile\nheight 1\nwidth 40\nmap\n' + '.' * 40 + '\n')
    bag = ROOT / 'bags/sample/0001_demo'
    assert main(['evaluate', '--world', str(path), '--demo-bag', str(bag), '--trials', '0']) == 2
    assert 'lie outside, the first after' in capsys.readouterr().err


def test_a_drive_is_said_with_what_was_dropped_of_it(capsys):
    bag = ROOT / 'bags/sample/0001_demo'
    assert main(['evaluate', '--world', 'task1', '--demo-bag', str(bag), '--trials', '0',
                 '--seeds', '1', '--json', '-']) == 0
    assert f'--demo-bag {bag}: 16 cells from 202 poses' in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'hint'), [
    (['--goal', '1,2,3'], 'X,Y'), (['--goal', 'nan,1'], 'X,Y'), (['--trials', '-1'], '-1'),
    (['--sight', '4'], 'must be odd'), (['--sight', '63'], '3 to 61'),
    (['--change', 'a.map'], 'K:FILE'), (['--change', '-1:a.map'], 'K:FILE'),
    (['--seeds', '0'], "'0'"), (['--jobs', 'many'], 'many'), (['--start-radius', '-1'], '0 m'),
])
def test_a_malformed_number_is_refused(world, arguments, hint, capsys):
    with pytest.raises(SystemExit) as stop:
        run(world, *arguments)
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert hint in error
    assert error.count('\n') == 1


def test_a_place_without_a_way_is_refused(tmp_path, capsys):
    path = tmp_path / 'split.map'
    path.write_text('type octile\nheight 3\nwidth 5\nmap\n..@..\n..@..\n..@..\n')
    assert run(path, goal='4.5,1.5', start='0.5,0.5') == 2
    assert 'no way' in capsys.readouterr().err


@pytest.mark.parametrize('jobs', ['1', '2'])
def test_a_teacher_without_a_detour_says_so(tmp_path, capsys, jobs):
    path = tmp_path / 'corridor.map'
    path.write_text('type octile\nheight 1\nwidth 6\nmap\n......\n')
    assert run(path, '--teacher', 'detour', '--jobs', jobs, goal='5.5,0.5', start='0.5,0.5') == 2
    error = capsys.readouterr().err
    assert 'evaluate: --teacher detour: no way of 1.3 to 2 times' in error
    assert error.endswith('was found (--demo-start 0.5,0.5)\n')


def test_start_radius_narrows_what_is_judged(world, tmp_path):
    assert run(world, '--start-radius', '1.0', '--json', str(tmp_path / 'a.json')) == 0
    assert json.loads((tmp_path / 'a.json').read_text())['config']['n_starts'] == 5


def test_the_greedy_way_through_the_dyna_maze_becomes_the_shortest_and_the_field_is_faithful(
        tmp_path):
    assert main(['evaluate', '--world', 'dyna', '--set', 'moves=4', '--goal', '8.5,5.5',
                 '--demo-start', '0.5,3.5', '--demo-steps', '16', '--trials', '3', '--seeds', '4',
                 '--json', str(tmp_path / 'a.json')]) == 0
    report = json.loads((tmp_path / 'a.json').read_text())
    assert report['config']['demo_steps'] == 16
    for entry in report['after']:
        assert entry['flow_steps']['values'] == [16.0] * 4
        assert entry['fidelity']['values'] == [1.0] * 4
    for steps, greedy in zip(*(report['after'][-1][name]['values']
                               for name in ('steps', 'greedy_steps')), strict=True):
        assert steps <= 50
        assert greedy == 14.0


def test_moves_without_diagonals_hold_for_teacher_and_field(world, tmp_path):
    assert run(world, '--set', 'moves=4', '--save-field', str(tmp_path / 'field.npz')) == 0
    field = np.load(tmp_path / 'field.npz')
    assert (np.abs(field['actions']).max(axis=1) == 1.0).all()
