"""A memory that grows is as if it had been large from the beginning."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import CellBox, default_lattice, Grid
from control_field.learning.growth import FittedWorkspace
from control_field.learning.learner import Learner, with_old_headings
from control_field.learning.memory import Memory
from control_field.parameters import Parameters
from control_field.records import (
    DECISION_DTYPE, Demonstration, Kind, local_grid_dtype, no_local_grids, Outcome, Trial)
from strategies import demonstration_of, few, practise, relearner, segment, taught

LATTICE = default_lattice(0.25)
ARRAYS = ('q', 'known', 'demonstrated', 'action', 'episode', 'stamp')
EVIDENCE = ('state', 'age', 'opened', 'certain_for', 'strength', 'outdated')


def walk(seed, n=30, start=(0, 0)):
    """Return cells of a random walk, each a neighbour of the one before."""
    rng = np.random.default_rng(seed)
    steps = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)])
    return np.concatenate([[start], start + np.cumsum(steps[rng.integers(0, 8, n)], axis=0)])


def local_grids_along(cells, seed, side=9):
    """Return wide local grids seen from some of the cells."""
    rng = np.random.default_rng(seed)
    table = np.zeros(len(cells) // 4, local_grid_dtype(side))
    at = np.sort(rng.choice(len(cells), len(table), replace=False))
    table['stamp'], table['row'], table['col'] = at, cells[at, 0], cells[at, 1]
    table['cells'] = rng.choice([0, 0, 100, -1], (len(table), side, side))
    return table


def demonstration(seed):
    cells = walk(seed)
    rng = np.random.default_rng(seed)
    masks = rng.integers(0, 256, (2, len(cells)), dtype=np.uint8)
    return Demonstration(cells.astype(np.int32), np.arange(len(cells)) * 1.0, masks[0] & ~masks[1],
                         masks[1], 1, local_grids_along(cells, seed))


def random_trial(seed, number, start):
    rng = np.random.default_rng(seed)
    cells = walk(seed, start=start)
    rows = np.zeros(len(cells) - 1, DECISION_DTYPE)
    (rows['row'], rows['col']), (rows['next_row'], rows['next_col']) = cells[:-1].T, cells[1:].T
    rows['stamp'] = np.arange(len(rows))
    rows['action'], rows['reward'] = rng.integers(0, 8, len(rows)), rng.integers(-1, 2, len(rows))
    rows['kind'] = rng.choice([Kind.FIELD, Kind.BLOCKED, Kind.AVOID, Kind.TAUGHT], len(rows))
    rows['unknown'] = rng.integers(0, 256, len(rows))
    rows['blocked'] = rng.integers(0, 256, len(rows)) & ~rows['unknown']
    outcome = Outcome.GOAL if rng.integers(2) else Outcome.COLLISION
    return Trial(rows, outcome, number, local_grids_along(cells, seed))


def ends_elsewhere(record):
    return record.cells[0].tolist() != record.cells[-1].tolist()


def episodes(seed):
    """Return a demonstration and trials that lead farther and farther away."""
    first = next(each for each in map(demonstration, range(seed, seed + 9))
                 if ends_elsewhere(each))
    rng = np.random.default_rng(seed)
    return [first, *(random_trial(seed + n, n, rng.integers(-20 * n, 20 * n, 2))
                     for n in range(2, 5))]


def folded(records, begin=None):
    """Learn from records in cells of LATTICE; in a workspace that grows, or in one given."""
    memory, workspace = None, FittedWorkspace(LATTICE)
    for record in records:
        workspace = workspace.with_record(record, LATTICE)
        grid = begin or workspace.grid
        memory = memory or Memory(grid, Parameters())
        moved = record.shifted(*LATTICE.offset_to(grid))
        add = memory.add_trial if isinstance(record, Trial) else memory.add_demonstration
        add(moved, grid)
    return memory, workspace


@given(st.integers(0, 10_000))
@few
def test_a_memory_that_grew_is_as_if_it_had_always_been_as_large(seed):
    records = episodes(seed)
    grown, workspace = folded(records)
    large, _ = folded(records, workspace.grid)
    assert grown.grid == large.grid
    assert grown.goal == large.goal
    for name in ARRAYS:
        assert np.array_equal(getattr(grown, name), getattr(large, name),
                              equal_nan=name == 'stamp'), name
    for name in EVIDENCE:
        assert np.array_equal(getattr(grown.evidence, name), getattr(large.evidence, name)), name
    ours, theirs = grown.prototypes(), large.prototypes()
    assert np.array_equal(ours.cells, theirs.cells)
    assert np.array_equal(ours.q, theirs.q)


@given(st.integers(0, 10_000), st.integers(-500, 500), st.integers(-500, 500))
@few
def test_where_a_frame_has_its_origin_changes_nothing_but_the_place(seed, rows, cols):
    """Far away, at negative coordinates: the same memory, multiples of 8 cells aside."""
    records = episodes(seed)
    here, _ = folded(records)
    there, _ = folded([record.shifted(8 * rows, 8 * cols) for record in records])
    assert there.grid.offset_to(here.grid) == (8 * rows, 8 * cols)
    for name in ARRAYS:
        assert np.array_equal(getattr(here, name), getattr(there, name),
                              equal_nan=name == 'stamp'), name


@given(st.integers(0, 10_000))
@few
def test_the_workspace_holds_all_that_was_seen_and_eight_cells_around_the_robot(seed):
    records = episodes(seed)
    for n in range(1, len(records) + 1):
        memory, _ = folded(records[:n])
        rows, cols = memory.grid.shape
        assert rows % 8 == cols % 8 == 0
        been = np.argwhere(memory.action >= 0)
        assert been.min() >= 8
        assert (been < np.array(memory.grid.shape) - 8).all()
        seen = np.argwhere(memory.known >= 0)
        assert seen.min() >= 1
        assert (seen < np.array(memory.grid.shape) - 1).all()
        for record in records[:n]:  # nothing that a wide local grid shows is lost
            for each in record.local_grids:
                at = np.argwhere(each['cells'] >= 0) + (each['row'] - 4, each['col'] - 4)
                assert (memory.known[tuple((at + LATTICE.offset_to(memory.grid)).T)] >= 0).all()


def test_nothing_of_a_record_that_is_refused_makes_it_grow():
    memory, workspace = folded(episodes(1))
    before = memory.grid
    larger = workspace.with_record(demonstration_of([(90, 90), (91, 90)]), LATTICE).grid
    loop = demonstration_of([(9, 9), (9, 10), (9, 9)])
    with pytest.raises(ValueError, match='ends in the cell where it began'):
        memory.add_demonstration(loop, larger)
    wrong = random_trial(3, 2, (0, 0)).shifted(*LATTICE.offset_to(larger))
    rows = wrong.decisions.copy()
    rows['action'] = 9
    with pytest.raises(ValueError, match='action is not 0 to 7'):
        memory.add_trial(Trial(rows, Outcome.GOAL), larger)
    assert memory.grid is before


@pytest.mark.parametrize('other', [
    Grid(40, 40, 0.25), Grid(4, 4, 0.5), LATTICE.window(CellBox(0, 0, 8, 8))])
def test_a_workspace_that_does_not_hold_the_present_one_is_refused(other):
    memory = Memory(LATTICE.window(CellBox(-8, -8, 15, 15)), Parameters())
    with pytest.raises(ValueError, match='does not hold the cells'):
        memory.grow(other)


def test_a_record_of_another_lattice_has_no_place():
    with pytest.raises(ValueError, match='are not those of'):
        FittedWorkspace(LATTICE).with_record(demonstration_of([(0, 0), (0, 1)]), Grid(9, 9, 0.3))


def test_local_grids_that_show_nothing_need_no_room():
    blind = local_grids_along(walk(1), 1)
    blind['cells'] = -1
    bare = demonstration_of(segment((0, 0), (0, 5)))
    seeing = Demonstration(bare.cells, bare.stamps, bare.blocked, bare.unknown, 1, blind)
    boxes = [FittedWorkspace(LATTICE).with_record(each, LATTICE).box for each in (bare, seeing)]
    assert boxes[0] == boxes[1] == (-8, -8, 15, 15)
    nothing = Trial(np.zeros(0, DECISION_DTYPE), Outcome.ABORTED, 2, no_local_grids())
    assert FittedWorkspace(LATTICE).with_record(nothing, LATTICE).grid is None


@given(relearner(low=4, blind=True), st.data())
@few
def test_headings_that_were_better_are_kept_where_they_were_when_the_workspace_grew(
    learnt_bag, data,
):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, step_limit=200, repair=False, rehearsal=False)
    free = np.argwhere(occupancy == 0).tolist()
    practise(learner, occupancy, [data.draw(st.sampled_from(free))])
    old = learner.refresh.composition
    grid = learner.grid.window(CellBox(-8, -16, *(n + 7 for n in occupancy.shape)))
    trial = Trial(np.zeros(0, DECISION_DTYPE), Outcome.GAVE_UP, 9)
    new = learner.add_trial(trial, grid).composition
    kept = with_old_headings(old, new)
    within = (slice(8, 8 + occupancy.shape[0]), slice(16, 16 + occupancy.shape[1]))
    is_new = np.ones(grid.shape, dtype=bool)
    is_new[within] = False
    for name in ('vx', 'vy', 'coherence', 'flags'):
        layer = getattr(kept.field, name)
        assert np.array_equal(layer[within], getattr(old.field, name))
        assert np.array_equal(layer[is_new], getattr(new.field, name)[is_new])
    assert np.array_equal(kept.field.known, new.field.known)
    assert kept.field.goal == (old.field.goal[0] + 8, old.field.goal[1] + 16)
    ours = kept.prototypes.cells[~is_new[tuple(kept.prototypes.cells.T)]]
    assert np.array_equal(ours, old.prototypes.cells + (8, 16))
    assert np.array_equal(np.lexsort(kept.prototypes.cells.T[::-1]), np.arange(len(kept.weights)))
    assert learner.refresh.field.grid == grid


def test_in_a_workspace_that_fits_trials_start_where_the_ground_is_known_teaching_beside():
    occupancy = np.zeros((12, 12), np.int8)
    cells = segment((2, 2), (2, 9))
    for fitted in (False, True):
        learner = Learner(Grid(12, 12, 1.0), Parameters(), fitted)
        learner.add_demonstration(demonstration_of(cells, occupancy))
        known = learner.refresh.field.known
        starts = learner.next_starts(40, np.random.default_rng(0))
        places = learner.teach_here(40)
        assert starts
        assert places
        assert all(known[cell] == 0 for cell in starts) == fitted
        beside = [known[max(row - 1, 0):row + 2, max(col - 1, 0):col + 2] for row, col in places]
        assert all((around == 0).any() for around in beside) == fitted
        assert any(known[cell] < 0 for cell in places)
