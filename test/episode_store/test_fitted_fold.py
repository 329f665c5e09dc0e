"""Bags of a workspace that fits itself, folded: it grows with them, and no cell moves."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bridge_helpers import GRID, raw_local_grid
from control_field.grid import CellBox, default_lattice, fitted_workspace, Grid
from control_field.parameters import Parameters
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError, WorkspaceError
from episode_store.header import EpisodeHeader
from episode_store.relearn import relearn, Relearner
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeKind, TaskFolder
from episode_store.workspaces import check_workspaces
from fitted_bags import demo, HERE, recorded, trial
from sample_helpers import bytes_of, sample_copy


@pytest.fixture
def task(tmp_path):
    return TaskFolder(tmp_path, 'task1')


def known_by_place(field):
    """Return what a field remembers of each cell, by its centre in cells of HERE."""
    cells = np.argwhere(field.known >= 0)
    offset = field.grid.offset_to(HERE)
    return {tuple((cell + offset).tolist()): int(field.known[tuple(cell)]) for cell in cells}


def test_one_by_one_and_all_at_once_are_the_same_bytes(task):
    fold = Relearner(None, Parameters(), fitted=True)
    assert fold.grid is None
    assert fold.refresh is None
    each = recorded(task, fold)
    assert not any(bag.why_not for bag in each)
    sizes = [bag.refresh.field.grid for bag in each]
    assert len(set(sizes)) >= 3  # or nothing has grown
    again, all_at_once = relearn(task.episodes())
    assert [bytes_of(bag.refresh) for bag in all_at_once] == [
        bytes_of(bag.refresh) for bag in each]
    assert bytes_of(relearn(task.episodes())[0].refresh) == bytes_of(again.refresh)
    assert again.grid == fold.grid
    assert again.demonstrated_starts == fold.demonstrated_starts


def wandering(rng, grid):
    """Return cells of a random way that may leave a grid, and what was seen where it begins."""
    steps = [step for step in rng.integers(-1, 2, (20, 2)) if step.any()]
    cells = rng.integers(1, np.array(grid.shape) - 1) + np.cumsum(steps, axis=0)
    seen = rng.choice([0, 100, -1], (31, 31))
    seen[14:17, 14:17] = -1
    return cells, [(9.95, raw_local_grid(9.95, *cells[0].tolist(), seen, grid))]


@pytest.mark.parametrize('seed', [3, 10])
def test_whatever_the_bags_are_they_teach_the_same_one_by_one_and_all_at_once(task, seed):
    rng, off = np.random.default_rng(seed), np.random.default_rng(seed).uniform(-50, 50, 2)
    fold, each = Relearner(None, Parameters(seed=seed), fitted=True), []
    lattice = Grid(1, 1, 0.25, 0.1, -0.07)
    for number in range(5):
        if number % 3 == 0:
            corners = [tuple(off + rng.uniform(-4, 4, 2)) for _ in range(3)]
            bag = demo(task, corners, lattice, grid=fold.grid, begins=fold)
        else:
            room = fold.grown_to([tuple(off + rng.uniform(-8, 8, 2))])
            cells, seen = wandering(rng, room.grid)
            bag = trial(task, cells, room.grid, begins=room, outcome=Outcome.GAVE_UP,
                        local_grids=seen)
        each.append(fold.learn(Episode(bag)))
    assert not any(bag.why_not for bag in each)
    assert len({bag.refresh.field.grid for bag in each}) >= 3
    again = Relearner(fold.grid, Parameters(seed=seed), fitted=True)
    for before, folder in zip(each, task.episodes(), strict=True):
        assert bytes_of(again.learn(Episode(folder)).refresh) == bytes_of(before.refresh)


def test_every_cell_keeps_its_place_and_the_goal_is_where_it_was(task):
    fold = Relearner(None, Parameters(), fitted=True)
    each = recorded(task, fold)
    fields = [bag.refresh.field for bag in each]
    goals = {tuple(np.add(field.goal, field.grid.offset_to(HERE))) for field in fields}
    assert goals == {HERE.cell_from_world(2.0, 1.0)}
    assert not any(bag.moved for bag in each)
    for before, after in pairwise(fields):
        old, new = known_by_place(before), known_by_place(after)
        assert old.items() <= new.items()
        offset = before.grid.offset_to(after.grid)
        assert min(offset) >= 0
        assert after.grid.contains(*np.add(offset, before.grid.shape) - 1)


def test_a_trial_that_sees_farther_makes_the_workspace_larger(task):
    demo(task, [(0.0, 0.0), (2.0, 0.0)])
    small = relearn(task.episodes())[0].grid
    cells = np.full((41, 41), -1)
    cells[20, 20:38] = 0
    cells[20, 38] = 100  # 18 cells to the right of cell (0, 8)
    row, col = small.cell_from_world(2.0, 0.0)
    wide = [(9.95, raw_local_grid(9.95, row, col - 1, cells, small))]
    trial(task, [(row, col - 1), (row, col)], small, local_grids=wide, unknown=0b11111110)
    _, [_, learnt] = relearn(task.episodes())
    large = learnt.refresh.field.grid
    assert large.n_rows == small.n_rows
    assert large.n_cols > small.n_cols
    seen = known_by_place(learnt.refresh.field)
    assert seen[(0, 7 + 18)] == 100
    assert seen[(0, 7 + 17)] == 0


@pytest.mark.parametrize('first', [2, -12])
def test_decisions_count_by_place_whatever_the_extent_of_the_field_they_were_made_on(task, first):
    demo(task, [(0.0, 0.0), (2.0, 0.0)])
    began = relearn(task.episodes())[0].grid
    grown = began.window(CellBox(-8, -4, *(n + 7 for n in began.shape)))
    # Also where a person leads the robot out of it.
    cells = np.array([(0, n) for n in range(first, first + 6)])
    bag = trial(task, cells + HERE.offset_to(grown), began, driven=grown)
    content = Episode(bag).content
    assert not content.doubt
    rows = content.record.decisions
    there = np.stack([rows['row'], rows['col']], axis=1) + began.offset_to(HERE)
    assert np.array_equal(there, cells[:-1])


@pytest.mark.parametrize(('corners', 'shape'), [
    ([(0.0, 0.0), (0.5, 0.0)], (24, 24)),
    ([(0.0, 0.0), (-0.5, -0.3)], (32, 32)),
    ([(-7.3, -90.1), (-8.3, -91.0)], (32, 32)),
    ([(0.0, 0.0), (-30.0, 4.0)], (40, 144)),
    ([(1e6, -2e6), (1e6 - 3.0, -2e6 + 3.0)], (32, 40))])
def test_drives_anywhere(task, corners, shape):
    demo(task, corners)
    [learnt] = relearn(task.episodes())[1]
    field = learnt.refresh.field
    assert field.grid.shape == shape
    assert field.grid.world_from_cell(*field.goal) == pytest.approx(corners[-1], abs=0.13)
    assert learnt.refresh.certificate.basin == 1.0


def test_a_lattice_of_a_simulator_is_kept(task):
    lattice = Grid(20, 20, 0.25, -2.0, -1.0)
    demo(task, [(0.6, 0.6), (3.0, 0.6)], lattice)
    grid = relearn(task.episodes())[0].grid
    assert grid.offset_to(lattice) is not None
    assert (grid.origin_x / 0.25) % 1.0 == 0.0


def test_a_place_too_large_says_which_resolution_would_fit(task, monkeypatch):
    monkeypatch.setattr('control_field.grid.MOST_CELLS', 2000)
    demo(task, [(0.0, 0.0), (12.0, 12.0)])
    with pytest.raises(BagError, match=r'0001_demo cannot be learnt from: 72 x 72 cells of 0.25 m '
                                       r'are more .* with resolution 0.\d+ it would fit'):
        relearn(task.episodes())


class TestPosesThatAreWrong:
    """They are refused, or left out, before they make anything grow."""

    def spiky(self, task, places):
        bag = demo(task, [(0.0, 0.0), (2.0, 0.0)], instead=places)
        return relearn(task.episodes())[1][0], Episode(bag)

    @pytest.mark.parametrize('place', [(300.0, 200.0), (1e8, -1e8), (1e300, 0.0)])
    def test_a_spike(self, task, place):
        learnt, _ = self.spiky(task, {40: place})
        assert learnt.refresh.field.grid.shape == (24, 32)

    @pytest.mark.parametrize('place', [(np.nan, np.nan), (np.inf, 0.0)])
    def test_no_numbers(self, task, place):
        learnt, _ = self.spiky(task, {40: place})
        assert learnt.refresh.field.grid.shape == (24, 32)

    def test_a_drive_that_leaps_is_refused(self, task):
        learnt, _ = self.spiky(task, {n: (500.0 + n, 0.0) for n in range(30, 60)})
        assert 'leaps' in learnt.why_not
        assert learnt.refresh is None

    def test_local_grids_of_elsewhere_are_not_room(self, task):
        wide = np.zeros((41, 41))
        far = [(11.0, raw_local_grid(11.0, 2000, 3000, wide, HERE))]
        demo(task, [(0.0, 0.0), (2.0, 0.0)], local_grids=far)
        assert relearn(task.episodes())[0].grid.shape == (24, 32)

    def test_a_trial_whose_decisions_are_elsewhere_is_not_learnt(self, task):
        demo(task, [(0.0, 0.0), (2.0, 0.0)])
        grid = relearn(task.episodes())[0].grid
        far = fitted_workspace(HERE, np.array([[500.0, 0.0]]))
        cells = [(10, n) for n in range(2, 8)]
        bag = trial(task, cells, grid, driven=grid)
        moved = trial(task, cells, grid, driven=far, odometry=grid)
        fold, [_, there, elsewhere] = relearn(task.episodes())
        assert (there.folder, elsewhere.folder) == (bag, moved)
        assert there.refresh is not None
        assert elsewhere.refresh is None
        assert fold.grid.n_cols < 100


class TestExplicitTasks:
    """Workspaces that are given, and how they go on when they fit themselves from now on."""

    def test_they_are_learnt_as_ever(self, tmp_path):
        task = sample_copy(tmp_path)
        fold, _ = relearn(task.episodes())
        assert not fold.fitted
        assert fold.grid == Episode(task.find(1)).header.grid

    def test_the_sample_goes_on_in_a_workspace_that_fits_itself(self, tmp_path):
        task = sample_copy(tmp_path)
        header = Episode(task.find(1)).header
        fold = Relearner(header.grid, header.parameters, fitted=True)
        for folder in task.episodes():
            assert not fold.learn(Episode(folder)).why_not
        before, explicit = fold.refresh, relearn(task.episodes())[0].refresh
        assert before.field.grid.offset_to(explicit.field.grid) is not None
        assert before.certificate.basin == explicit.certificate.basin == 1.0
        place = [field.grid.world_from_cell(*field.goal)
                 for field in (before.field, explicit.field)]
        assert place[0] == pytest.approx(place[1])
        demo(task, [(2.0, 2.0), (9.0, 2.0)], header.grid)
        again, each = relearn(task.episodes())
        assert again.fitted
        assert not any(bag.why_not for bag in each)
        assert again.grid.contains(*again.grid.cell_from_world(10.9, 2.0))

    def test_a_bag_that_fits_itself_is_refused_by_an_explicit_fold_and_advice_mends_it(self, task):
        demo(task, [(0.6, 0.6), (3.0, 0.6)], GRID)
        demo(task, [(0.6, 0.6), (3.0, 0.6)], grid=GRID, fitted=False)
        with pytest.raises(BagError, match='let the workspace fit itself'):
            relearn(task.episodes())
        fold = Relearner(None, Parameters(), fitted=True)
        assert all(fold.learn(Episode(folder)).refresh for folder in task.episodes())

    def test_a_drive_that_leaves_an_explicit_workspace_is_refused_as_ever(self, task):
        bag = demo(task, [(0.6, 0.6), (9.0, 0.6)], grid=GRID, fitted=False)
        with pytest.raises(NothingToLearnError, match='leaves the workspace'):
            _ = Episode(bag).content


class TestOtherCells:
    """Bags whose cells do not lie upon those of the others."""

    @pytest.mark.parametrize('other', [
        default_lattice(0.5), Grid(1, 1, 0.25), replace(HERE, frame_id='map')])
    def test_they_are_refused_with_both_and_what_to_do(self, task, other):
        for lattice in (HERE, HERE, other):
            demo(task, [(0.0, 0.0), (2.0, 0.0)], lattice)
        with pytest.raises(BagError, match=r'0003_demo was recorded on .*0001_demo and 1 more on '
                                           r'.* of the same cells; `experience forget '):
            relearn(task.episodes())

    def test_the_one_that_is_asked_for_counts(self, task):
        bag = demo(task, [(0.0, 0.0), (2.0, 0.0)])
        fold = Relearner(default_lattice(0.5), Parameters(), fitted=True)
        with pytest.raises(WorkspaceError, match=r'whose cells are not those of this workspace '
                                                 r'\(cells of 0.5 m, one at \(0, 0\), in .odom'):
            fold.learn(Episode(bag))

    def test_any_extent_is_one_workspace(self, task):
        for start in ((0.0, 0.0), (-40.0, 7.0)):
            demo(task, [start, (start[0] + 2.0, start[1])])
        assert len(check_workspaces(task.episodes())) == 2


def test_a_fold_that_does_not_fit_needs_a_workspace():
    with pytest.raises(ValueError, match='must be given'):
        Relearner(None, Parameters())


def test_the_header_says_whether_the_workspace_fits_itself():
    header = EpisodeHeader(EpisodeKind.DEMO, 'task1', HERE, fitted=True)
    assert EpisodeHeader.from_mapping(header.to_mapping()) == header
    explicit = replace(header, fitted=False)
    assert 'fitted' not in explicit.to_mapping()
    assert EpisodeHeader.from_mapping(explicit.to_mapping()) == explicit
    with pytest.raises(BagError, match="fitted is 'perhaps', must be true or false"):
        EpisodeHeader.from_mapping({**header.to_mapping(), 'fitted': 'perhaps'})


def test_what_was_forgotten_takes_up_no_room(task):
    fold = Relearner(None, Parameters(), fitted=True)
    recorded(task, fold)
    demo(task, [(0.0, 0.0), (2.0, 0.0)])
    task.forget(1)
    again, each = relearn(task.episodes())
    assert [bool(bag.why_not) for bag in each] == [True, True, True, False]
    assert again.grid.shape == (24, 32)
