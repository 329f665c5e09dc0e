"""`experience evaluate` on maps of any resolution: cells of the robot's size."""

import io
import json

import numpy as np
from PIL import Image
import pytest

from control_field.grid import Grid
from control_field.words import counted
from experience_cli.main import main
from experience_evaluation import progress
from experience_evaluation.experiment import Experiment, run_seed
from experience_evaluation.starts import nearest_cell

#: Pixels of 5 cm a side of the room.
SIDE = 80


@pytest.fixture
def room(tmp_path):
    """Write a room of 4 m x 4 m with a table in it, in pixels of 5 cm; return its YAML."""
    pixels = np.full((SIDE, SIDE), 254, np.uint8)
    pixels[[0, -1]], pixels[:, [0, -1]], pixels[30:50, 30:50] = 0, 0, 0
    Image.fromarray(pixels).save(tmp_path / 'room.png')
    path = tmp_path / 'room.yaml'
    path.write_text('image: room.png\nresolution: 0.05\norigin: [-1.0, -1.0, 0.0]\nnegate: 0\n'
                    'occupied_thresh: 0.65\nfree_thresh: 0.25\n')
    return path


def evaluated(world, folder, *more, goal='2.5,2.5', start='-0.5,-0.5'):
    """Evaluate a world, and return what the report says of it."""
    report = folder / 'report.json'
    assert main(['evaluate', '--world', str(world), '--goal', goal, f'--demo-start={start}',
                 '--trials', '1', '--seeds', '1', '--json', str(report), *more]) == 0
    return json.loads(report.read_text())


@pytest.mark.parametrize(('options', 'side', 'n_most'), [
    ((), 0.25, 16 * 16), (('--robot-radius', '0.22'), 0.5, 8 * 8),
    (('--resolution', '0.4'), 0.4, 10 * 10), (('--robot-radius', '0.01'), 0.05, 78 * 78)])
def test_cells_are_of_the_size_of_the_robot(room, tmp_path, capsys, options, side, n_most):
    found = evaluated(room, tmp_path, *options)
    assert found['config']['resolution'] == side
    assert 0.3 * n_most < found['config']['n_starts'] <= n_most
    assert found['after'][-1]['success']['median'] == 1.0
    assert (f'cells of {side:g} m' in capsys.readouterr().err) == (side > 0.05)


def test_a_place_that_is_blocked_is_the_nearest_free_one_and_that_is_said(
        room, tmp_path, capsys):
    found = evaluated(room, tmp_path, goal='1,1', start='-0.98,2')
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if '--goal 1,1: that cell is blocked; taken is' in line]
    assert [line for line in said if '--demo-start -1,2: that cell is blocked; taken is' in line]
    assert found['after'][-1]['success']['median'] == 1.0


def test_a_world_without_a_free_cell_is_refused(tmp_path, capsys):
    path = tmp_path / 'full.map'
    path.write_text('type octile\nheight 3\nwidth 3\nmap\n' + '@@@\n' * 3)
    assert main(['evaluate', '--world', str(path), '--goal', '1,1', '--demo-start', '2,2']) == 2
    assert 'there is no free one' in capsys.readouterr().err


def test_of_cells_that_are_equally_near_the_first_is_taken():
    cells = np.zeros((5, 5), np.bool_)
    assert nearest_cell(cells, (2, 2)) is None
    cells[3, 2] = cells[2, 3] = cells[0, 0] = True
    assert nearest_cell(cells, (2, 2)) == (2, 3)


def test_whoever_waits_is_told_how_much_of_a_seed_is_done():
    told = []
    run_seed(Experiment(Grid(12, 12, 0.25), np.zeros((12, 12), np.int8), (10, 10), [(1, 1)], 2), 3,
             lambda what, share: told.append((what, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    rounds = [[f'judging {n} of 144 starts after {counted(number, "trial")}' for n in (0, 144)]
              for number in (0, 1, 2)]
    assert [what for what, _ in told] == [f'seed 3, {what}' for what in (
        'loading', 'teaching', *rounds[0], 'trial 1 of 2', *rounds[1], 'trial 2 of 2',
        *rounds[2])]


def test_what_is_told_of_a_run_moves_the_bar(monkeypatch):
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, 'isatty', lambda: True)
    monkeypatch.setattr(progress, 'own_stream', lambda stream: terminal)
    with progress.ProgressBar(2, 'evaluate', False) as bar:
        progress.count_for(1)
        progress.tell('seed 1, teaching', 0.5)
    assert list(bar.shares) == [0.0, 0.5]
    assert '25%' in terminal.getvalue()
    assert 'seed 1, teaching' in terminal.getvalue()


def test_runs_in_other_processes_are_told_of_by_what_they_share(monkeypatch):
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, 'isatty', lambda: True)
    monkeypatch.setattr(progress, 'own_stream', lambda stream: terminal)
    with progress.ProgressBar(4, 'evaluate', True) as bar:
        bar.shares[2] = 0.5
        bar.end(0)
    assert '38%' in terminal.getvalue()
    assert '1 of 4 runs are over' in terminal.getvalue()
