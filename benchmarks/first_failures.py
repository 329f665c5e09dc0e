"""
A robot that fails at first and then improves: the world dead_ends with its settings.

``python -m benchmarks.first_failures [DRIVES]`` lets so many people show the way, each once and
before the walls are there. Start, corner and goal of each drive, and what lies between, are up to
a cell away from those of the demo; the first drive is the demo's. Then the robot tries from where
it was shown, as in the demo, without nodes.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
import sys
from typing import Final, NamedTuple

import numpy as np

from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import explores, Learner
from control_field.parameters import Parameters
from control_field.records import Outcome
from experience_cli.demo.path_follower import cells_along
from experience_cli.demo.show_and_try import WAY
from experience_cli.demo.task_settings import settings_for
from experience_evaluation.teachers import demonstration_from_path
from world_maps.world import find_world, load_world

WORLD: Final = 'dead_ends'
N_TRIALS: Final = 10
#: Between start, corner and goal of the demo's way.
_BETWEEN: Final = ((3, 8), (9, 15))

Cell = tuple[int, int]


class Try(NamedTuple):
    """What a trial came to."""

    outcome: Outcome
    n_steps: int
    n_prototypes: int
    n_reinforcements: int


def way_shown(seed: int) -> list[Cell]:
    """Return the cells of a drive; that of seed 0 is the demo's."""
    rng = np.random.default_rng(seed)
    (start, corner, goal), (first, second) = WAY, _BETWEEN
    corners = np.array([start, first, corner, second, goal])
    if seed:
        corners += rng.integers(-1, 2, size=corners.shape)
    return cells_along([(int(row), int(col)) for row, col in corners])


def trials(seed: int, n_trials: int = N_TRIALS) -> list[Try]:
    """Show the way in the open workspace and let the robot try."""
    parameters = Parameters.from_mapping({**settings_for(WORLD, ''), 'seed': seed})
    world = load_world(find_world(WORLD))
    learner, way = Learner(world.grid, parameters), way_shown(seed)
    learner.add_demonstration(demonstration_from_path(
        GridWorld(np.zeros_like(world.occupancy), parameters), way, 1))
    truth, rng, tries = GridWorld(world.occupancy, parameters), np.random.default_rng(seed), []
    for number in range(2, n_trials + 2):
        trial, _ = truth.trial(learner.trial_field(explores(parameters, False)), way[0],
                               int(rng.integers(2**62)), number)
        refresh = learner.add_trial(trial)
        tries.append(Try(trial.outcome, trial.n_steps, len(refresh.prototypes),
                         refresh.reinforcements))
    return tries


def in_a_line(tries: Sequence[Try]) -> str:
    """Write steps of trials; those that did not reach the goal in brackets."""
    return ' '.join(str(each.n_steps) if each.outcome is Outcome.GOAL else f'({each.n_steps})'
                    for each in tries)


def main() -> int:
    """Measure and print."""
    n_drives = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    drives = [trials(seed) for seed in range(n_drives)]
    for seed, tries in enumerate(drives):
        print(f'drive {seed}: {in_a_line(tries)}')
    failures = Counter(sum(each.outcome is not Outcome.GOAL for each in tries) for tries in drives)
    print('\n| trials that failed | of so many drives |\n|---|---|')
    for n, count in sorted(failures.items()):
        print(f'| the first {n} of {N_TRIALS} | {count} |')
    relapses = sum(each.outcome is not Outcome.GOAL and before.outcome is Outcome.GOAL
                   for tries in drives for before, each in pairwise(tries))
    print(f'\na failure after a success: {relapses}')
    for name in ('n_steps', 'n_prototypes', 'n_reinforcements'):
        values = [[getattr(each, name) for each in tries] for tries in drives]
        print(f'{name}, median by trial:', *(f'{v:g}' for v in np.median(values, axis=0)))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
