"""
Measure what the robot makes of a world that changes: ``python -m benchmarks.changing_worlds``.

Over worlds of our own generators, another one for every seed; with ``--worlds FOLDER`` obstacles
are moved in MovingAI maps too. Each row says what was asked for.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.evaluation_tables import write_section
from benchmarks.how_good import DOC, median, Target, tasks_on
from benchmarks.own_tasks import own_tasks, Tasks
from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.parameters import Parameters
from experience_evaluation.changing_worlds import (
    BLOCKING, moved_obstacles, SHORTCUT, WALL_ROW, WALLED_SIZE, walled_world, with_block)
from experience_evaluation.experiment import Change, Experiment, LearningCurve, Row
from experience_evaluation.teachers import demonstration_from_path, detour_path
from experience_evaluation.workers import run_all
from experience_evaluation.worlds import Occupancy

#: Trials before the first change, which show (nearly) all there is, and after the last one.
N_BEFORE: Final = 10
N_AFTER: Final = 10
#: How long a way stays shut that opens again, [trials].
N_SHUT: Final = 3
#: How far what stands on the shown way reaches to every side, [cells].
BLOCK_REACH: Final = 1
#: Worlds in which obstacles are moved: of our own, and by the name of a map.
MOVED: Final = ('random, 10 %, 32 x 32', 'rooms of 3, 32 x 32', 'maze of width 4, 32 x 32')
MOVED_MAPS: Final = ('random-32-32-10', 'room-32-32-4', 'maze-32-32-4')


def walled_tasks(n_seeds: int, first: Sequence[int], *changes: tuple[int, Sequence[int]],
                 least_col: int = 0, margin: int = 2, **options: object) -> Tasks:
    """
    Return an experiment a seed on a square with a wall across it.

    Parameters
    ----------
    n_seeds : int
    first : sequence of int
        Columns of the gaps at first.
    *changes : tuple of (int, sequence of int)
        Numbers of trials, and the gaps after them.
    least_col : int
        Start and goal are drawn from this column on, on either side of the wall.
    margin : int, [cells]
        How far from the wall they are at least.
    options : object
        More of the experiment.

    """
    tasks = []
    for seed in range(n_seeds):
        rng = np.random.default_rng(seed)
        start = int(rng.integers(WALL_ROW - margin)), int(rng.integers(least_col, WALLED_SIZE))
        goal = (int(rng.integers(WALL_ROW + margin, WALLED_SIZE)),
                int(rng.integers(least_col, WALLED_SIZE)))
        experiment = Experiment(
            Grid(WALLED_SIZE, WALLED_SIZE, 1.0), walled_world(*first), goal, [start],
            (changes[-1][0] if changes else 0) + N_AFTER,
            changes=tuple(Change(after, walled_world(*gaps)) for after, gaps in changes))
        tasks.append((replace(experiment, **options), seed))  # type: ignore[arg-type]
    return tasks


def obstacle_tasks(n_seeds: int, spread: bool) -> Tasks:
    """
    Return an experiment a seed in which something stands on the shown way for some trials.

    It is so large that nobody who goes round it sees its middle.
    """
    tasks = []
    for experiment, seed in walled_tasks(n_seeds, range(WALLED_SIZE), margin=5, spread=spread):
        world = GridWorld(experiment.occupancy, experiment.parameters)
        path = detour_path(world, experiment.demo_starts[0], experiment.goal,
                             np.random.default_rng(seed))
        blocked = with_block(experiment.occupancy, path[len(path) // 2], BLOCK_REACH)
        tasks.append((replace(
            experiment, demonstrations=(demonstration_from_path(world, path, 1),),
            n_trials=N_BEFORE + N_SHUT + N_AFTER,
            changes=(Change(N_BEFORE, blocked),
                     Change(N_BEFORE + N_SHUT, experiment.occupancy))), seed))
    return tasks


def moved_tasks(tasks: Tasks) -> Tasks:
    """Return the tasks with a tenth of the obstacles moved after some trials."""
    def moved(experiment: Experiment, seed: int) -> Occupancy:
        return moved_obstacles(experiment.occupancy, 0.1, np.random.default_rng([seed, 1]),
                               experiment.goal, experiment.demo_starts[0])

    return [(replace(experiment, n_trials=N_BEFORE + N_AFTER,
                     changes=(Change(N_BEFORE, moved(experiment, seed)),)), seed)
            for experiment, seed in tasks]


def rows_since(curve: LearningCurve, change: int, n: int) -> list[Row]:
    """Return what a curve is judged after a change: before the first trial there, and after n."""
    first = curve.at_changes[change]
    return [first, *(row for row in curve.after
                     if first['trials'] < row['trials'] <= first['trials'] + n)]


def worst_of(curves: Sequence[LearningCurve], change: int, metric: str, n: int = N_AFTER,
             ) -> list[float]:
    """Return the medians' worst: of the trial whose median over the seeds is least, its values."""
    values = np.array([[row[metric] for row in rows_since(curve, change, n)] for curve in curves])
    worst = int(np.median(values, axis=0).argmin())
    return [float(value) for value in values[:, worst]]


def after(curves: Sequence[LearningCurve], change: int, metric: str, n: int) -> list[float]:
    """Return a metric of every seed n trials after a change."""
    return [rows_since(curve, change, n)[-1][metric] for curve in curves]


def collided(name: str, curves: Sequence[LearningCurve]) -> Target:
    """Return the row of the collisions, of the worst seed."""
    worst = max(row['collisions'] for curve in curves
                for row in (*curve.after, *curve.at_changes))
    return Target(f'{name}, collisions, worst', worst, 0, at_most=True)


def blocking_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure the blocking maze: the gap shuts, and another opens that was a wall."""
    name = 'blocking maze, spread starts'
    curves = run_all(
        walled_tasks(n_seeds, BLOCKING[0], (N_BEFORE, BLOCKING[1])), n_jobs, name)
    return [
        median(f'{name}, success, worst trial after the change', worst_of(curves, 0, 'success'),
               0.99),
        median(f'{name}, field_success after 3 trials', after(curves, 0, 'field_success', 3),
               0.99),
        collided(name, curves)]


def shortcut_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure the shortcut maze: a gap opens where start and goal are."""
    change = (N_BEFORE, SHORTCUT[1])
    rows = []
    for name, n, must, options in (
            ('spread starts', 5, 0.95, {}),
            ('fixed starts, prefer_shorter', 10, 0.90,
             {'spread': False, 'parameters': Parameters(prefer_shorter=True)}),
            ('spread starts, prefer_shorter', 5, float('nan'),
             {'parameters': Parameters(prefer_shorter=True)})):
        curves = run_all(walled_tasks(n_seeds, SHORTCUT[0], change, least_col=13, **options),
                         n_jobs, name)
        rows += [median(f'shortcut maze, {name}, SPL of the field after {n} trials',
                        after(curves, 0, 'field_success_spl', n), must)]
    return rows


def sealed_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure a wall that is shut altogether for some trials, and opens again."""
    rows = []
    for name, spread in (('spread', True), ('fixed', False)):
        what = f'all shut for {N_SHUT} trials, then open, {name} starts'
        curves = run_all(walled_tasks(
            n_seeds, BLOCKING[0], (N_BEFORE, ()), (N_BEFORE + N_SHUT, BLOCKING[0]),
            spread=spread), n_jobs, what)
        rows += [median(f'{what}, success in the first trial', after(curves, 1, 'success', 0),
                        0.99), collided(what, curves)]
    return rows


def obstacle_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure something that stands on the shown way for some trials and is gone then."""
    rows = []
    for name, spread in (('spread', True), ('fixed', False)):
        what = f'an obstacle on the shown way for {N_SHUT} trials, then gone, {name} starts'
        curves = run_all(obstacle_tasks(n_seeds, spread), n_jobs, what)
        fidelity = after(curves, 1, 'fidelity_in_truth', 10)
        rows += [
            median(f'{what}, fidelity in the true world after 10 trials', fidelity, 0.95),
            Target(f'{what}, share of the seeds that keep the whole shown way again',
                   float(np.mean(np.array(fidelity) == 1.0)), 0.95),
            median(f'{what}, success, worst trial', worst_of(curves, 0, 'success'), 0.99),
            collided(what, curves)]
    return rows


def moved_rows(
    name: str, tasks: Callable[[int], Tasks], n_seeds: int, n_jobs: int,
) -> list[Target]:
    """Measure a world of which a tenth of the obstacles is moved."""
    what = f'{name}, 10 % of the obstacles moved'
    curves = run_all(moved_tasks(tasks(n_seeds)), n_jobs, what)
    return [
        median(f'{what}, success, worst trial after it', worst_of(curves, 0, 'success'), 0.995),
        median(f'{what}, field_success before the next trial',
               after(curves, 0, 'field_success', 0), float('nan')),
        median(f'{what}, field_success after 10 trials', after(curves, 0, 'field_success', 10),
               0.97),
        collided(what, curves)]


Measure = Callable[[int, int], list[Target]]


def measures_of(folder: Path | None) -> dict[str, Measure]:
    """Return what is measured, by name: callables of the number of seeds and of jobs."""
    measures: dict[str, Measure] = {
        'blocking': blocking_rows, 'shortcut': shortcut_rows, 'sealed': sealed_rows,
        'obstacle': obstacle_rows}
    for name in MOVED:
        measures[f'moved, {name}'] = partial(moved_rows, name, partial(own_tasks, name))
    for path in () if folder is None else (folder / f'{name}.map' for name in MOVED_MAPS):
        measures[f'moved, {path.stem}'] = partial(moved_rows, path.stem, partial(tasks_on, path))
    return measures


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, row by row as they come."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--worlds', type=Path, help='a folder of MovingAI maps')
    parser.add_argument('--only', default='', help='only what has this in its name')
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--write', action='store_true', help='write it into doc/evaluation.md')
    options = parser.parse_args(arguments)
    lines = ['| what | median | over the seeds | must | met |', '|---|---|---|---|---|']
    print('\n'.join(lines))
    for name, measure in measures_of(options.worlds).items():
        for row in measure(options.seeds, options.jobs) if options.only in name else ():
            lines.append(row.line())
            print(row.line(), flush=True)
    if options.write:
        write_section(DOC, 'changing worlds', '\n'.join(lines))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
