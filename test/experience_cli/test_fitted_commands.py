"""Every command on a task whose workspace fits itself: bags and fields of several extents."""

import json
import shutil

import numpy as np
import pytest

from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.relearn import relearn, Relearner
from episode_store.task_folder import TaskFolder
from experience_cli.main import main
from fitted_bags import demo, HERE, recorded, trial


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """Record a demonstration, three trials, and one more demonstration from outside of all."""
    task = TaskFolder(tmp_path_factory.mktemp('bags'), 'task1')
    fold = Relearner(None, Parameters(), fitted=True)
    recorded(task, fold)
    demo(task, [(-9.0, 3.0), (-9.0, 1.0), (2.0, 1.0)], grid=fold.grid, begins=fold)
    return task


@pytest.fixture
def task(made, tmp_path, monkeypatch):
    shutil.copytree(made.path, tmp_path / 'bags' / 'task1')
    monkeypatch.chdir(tmp_path)
    return TaskFolder(tmp_path / 'bags', 'task1')


@pytest.fixture
def said(task, capsys):
    """Run a command that succeeds; return what it prints."""
    def call(*words, code=0):
        assert main(list(words)) == code
        return capsys.readouterr().out

    return call


def test_they_are_listed_as_kept(said):
    rows = json.loads(said('list', 'task1', '--json'))
    assert [row['state'] for row in rows] == ['kept'] * 5


def test_a_bag_shows_its_workspace_and_that_it_fits_itself(said):
    text = said('show', 'task1/0003')
    assert 'workspace' in text
    assert 'when it began; it fits itself' in text
    about = json.loads(said('show', 'task1/0005', '--json'))
    assert about['fitted']
    shown = about['demonstration']
    assert shown['start'] == pytest.approx([-9.0, 3.0], abs=0.13)
    assert shown['start_cell'] == list(Grid(**about['grid']).cell_from_world(-9.0, 3.0))


def test_all_bags_are_learnt_and_each_began_with_the_field_of_those_before(said, capsys):
    assert main(['learn', 'bags/task1', '--check']) == 0
    out, err = capsys.readouterr()
    assert 'nothing was learnt' not in out
    assert '4 bags with a recorded field, each is the relearnt one byte for byte' in err


@pytest.mark.parametrize('number', [1, 4, 5])
def test_a_picture_of_each(said, task, number):
    text = said('inspect', f'task1/{number:04d}')
    assert 'robot gets to the goal' in text
    assert list(task.path.glob(f'000{number}*.png'))


@pytest.mark.parametrize('number', [2, 3, 4])
@pytest.mark.parametrize('at', [0.6])
def test_a_decision_is_explained_in_cells_of_its_own_workspace(said, task, number, at):
    about = json.loads(said('explain', f'task1/{number:04d}', '--at', str(at), '--json'))
    assert about['decision']
    grid = Episode(task.find(number)).header.grid
    assert about['cell'] == list(grid.cell_from_world(*about['place']))
    assert about['course']['adds_up']
    for voice in about['course']['prototypes']:
        assert voice['place'] == pytest.approx(grid.world_from_cell(*voice['cell']))


def test_where_the_field_in_force_did_not_reach_there_is_no_heading(said):
    assert 'the workspace of the field that was in force did not reach there' in said(
        'explain', 'task1/0005', '--at', '3.0')
    assert 'field revision 4' in said('explain', 'task1/0005', '--at', '60')


class TestDifferences:
    """Fields of several extents beside each other."""

    def test_a_field_and_what_it_grew_into(self, said, task):
        about = json.loads(said('diff', 'task1/0002', 'task1', '--json'))
        grids = [Episode(task.find(2)).field().grid, relearn(task.episodes())[0].grid]
        assert about['cells'] == grids[0].n_rows * grids[0].n_cols
        assert about['cells_of_one_only'] == grids[1].n_rows * grids[1].n_cols - about['cells']
        assert not about['goal_moved']
        # Added where the second demonstration leads: by place.
        grid = Grid(**about['grid'])
        there = [grid.world_from_cell(*cell) for cell in about['prototypes']['added']]
        assert any(np.allclose(place, (-9.0, 2.0), atol=0.13) for place in there)
        assert about['first']['goal_place'] == pytest.approx(about['second']['goal_place'])

    def test_each_is_judged_in_its_own_workspace(self, said, task):
        about = json.loads(said('diff', 'task1/0003', 'task1', '--json'))
        refresh = relearn(task.episodes())[0].refresh
        assert about['second']['basin'] == pytest.approx(refresh.certificate.basin)
        assert about['first']['basin'] == 1.0

    def test_a_saved_field(self, said, task):
        said('learn', 'bags/task1', '--save', 'all.npz')
        about = json.loads(said('diff', 'all.npz', 'task1', '--json'))
        assert about['courses_differ'] == about['cells_of_one_only'] == 0
        text = said('diff', 'all.npz', 'task1/0002')
        assert 'of one of them only' in text

    def test_what_is_of_other_cells_is_refused(self, said, task, capsys):
        other = TaskFolder(task.path.parent, 'other')
        demo(other, [(0.0, 0.0), (3.0, 0.0)], Grid(1, 1, 0.5))
        assert main(['diff', 'task1', 'other']) == 2
        assert 'cannot be compared' in capsys.readouterr().err


def test_a_demonstration_that_left_the_workspace_is_cut_as_any_other(said):
    text = said('trim', 'task1/0005', '--from', '5')
    assert '0005 is cut' in text
    assert 'to (2.00, 1.00) m' in text
    assert 'whole again' in said('trim', 'task1/0005', '--undo')


def test_taking_a_bag_out_and_judging_one_learns_anew(said, task):
    before = relearn(task.episodes())[0].grid
    assert 'learnt anew' in said('forget', 'task1/0004')
    after = relearn(task.episodes())[0].grid
    assert after.n_cols < before.n_cols
    assert 'learnt anew' in said('label', 'task1/0003', 'success')
    assert HERE.offset_to(after) is not None


def test_a_field_that_was_grown_to_hold_the_robot_is_the_relearnt_one(tmp_path, capsys):
    task = TaskFolder(tmp_path, 'task1')
    fold = Relearner(None, Parameters(), fitted=True)
    fold.learn(Episode(demo(task, [(0.0, 0.0), (2.0, 0.0)])))
    grown = fold.grown_to([(-5.0, 5.0)])
    start = grown.grid.cell_from_world(-5.0, 5.0)
    cells = [start, (start[0] - 1, start[1] + 1), (start[0] - 2, start[1] + 2)]
    trial(task, cells, grown.grid, outcome=Outcome.GAVE_UP, begins=grown)
    assert main(['learn', str(task.path), '--check']) == 0
    assert '1 bag with a recorded field, each is the relearnt one' in capsys.readouterr().err
    assert main(['explain', f'{task.path}/0002_trial', '--at', '0.2', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['course']['adds_up']
