"""Hypothesis strategies for worlds, demonstrations and trials, and builders that tests share."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
import numpy as np

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels.steps import allowed_steps, StepRules
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import Demonstration

#: The same examples every time, so that a failure belongs to a change and to nothing else.
steady = settings(derandomize=True, database=None, deadline=None, max_examples=40)
few = settings(steady, max_examples=25)

rules = st.builds(StepRules, st.booleans(), st.booleans(), st.sampled_from([4, 8]))
masks = st.integers(0, 255)
seeds = st.integers(0, 2**32 - 1)
headings = st.integers(0, 7)


def occupancies(states=(0, 0, 0, 100), low=1, high=8):
    """Return a strategy for maps of cell states; states named twice are twice as likely."""
    side = st.integers(low, high)
    return st.tuples(side, side).flatmap(
        lambda shape: hnp.arrays(np.int8, shape, elements=st.sampled_from(states)))


#: True maps, mostly free.
worlds = occupancies()
#: Remembered maps.
knowns = occupancies((0, 0, -1, -1, 60, 100))


@st.composite
def drives(draw, occupancy, moves=8, corner_cutting=False, longest=20):
    """Return the cells of a drive through free ground, loops and all; at least one cell."""
    free = np.argwhere(occupancy == 0).tolist()
    cells = [tuple(draw(st.sampled_from(free)))]
    ahead = draw(headings)
    for turn in draw(st.lists(st.sampled_from([0, 0, 0, 1, -1, 2, -2]), max_size=longest)):
        ahead = (ahead + turn) % 8
        row, col = cells[-1]
        if allowed_steps(occupancy, row, col, (corner_cutting, False, moves)) >> ahead & 1:
            cells.append((row + int(STEP_ROW[ahead]), col + int(STEP_COL[ahead])))
    return cells


@st.composite
def relearner(draw, low=3, high=8, blind=False):
    """Return a true map and a drive in it that does not end where it began."""
    occupancy = draw(occupancies(low=low, high=high))
    occupancy[0, :2] = 0
    ground = np.zeros_like(occupancy) if blind else occupancy
    cells = draw(drives(ground))
    if cells[-1] == cells[0]:
        cells = [(0, 0), (0, 1)]
    occupancy[cells[-1]] = 0
    return occupancy, cells


def segment(*corners):
    """Return the cells of a drive along straight segments between corners."""
    cells = [corners[0]]
    for corner in corners[1:]:
        while cells[-1] != corner:
            step = np.sign(np.subtract(corner, cells[-1])).tolist()
            cells.append((cells[-1][0] + step[0], cells[-1][1] + step[1]))
    return cells


def demonstration_of(cells, occupancy=None, episode=1):
    """Return a demonstration along cells, with what local grids show there (nothing: unknown)."""
    n = len(cells)
    blocked, unknown = np.zeros(n, np.uint8), np.full(n, 255, np.uint8)
    if occupancy is not None:
        world = GridWorld(occupancy, Parameters())
        blocked[:] = [world.local_grid(row, col) for row, col in cells]
        unknown[:] = 0
    return Demonstration(
        np.array(cells, np.int32).reshape(n, 2), np.arange(n) * 1.0, blocked, unknown, episode)


def taught(cells, shape, occupancy=None, **values):
    """Return a learner of one demonstration."""
    learner = Learner(Grid(*shape, 1.0), Parameters(**values))
    learner.add_demonstration(demonstration_of(cells, occupancy))
    return learner


def practise(learner, occupancy, starts, first=2, seed=0, exploring=False):
    """Run trials from cells, one after the other, and learn from each; return the trials."""
    world, trials = GridWorld(occupancy, learner.parameters), []
    for number, start in enumerate(starts, first):
        trial, _ = world.trial(
            learner.trial_field(exploring), tuple(start), seed + number, number)
        learner.add_trial(trial)
        trials.append(trial)
    return trials
