"""
Measure how good the method is, row by row: ``python -m benchmarks.how_good --worlds FOLDER``.

For any folder of maps: MovingAI maps are sorted into families by their name (empty, random, room,
maze), map_server maps are taken for BARN worlds. Goal and start are drawn anew for every seed.
With ``--own`` over worlds of the same families that are generated, another one for every seed.
The paper's tasks and the Dyna maze are measured besides, unless ``--own`` or ``--only`` is given.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
import math
from pathlib import Path

import numpy as np

from benchmarks.evaluation_tables import write_section
from benchmarks.own_tasks import OWN, own_barn_tasks, own_tasks, Tasks
from benchmarks.paper_tasks import dyna_curves, DYNA_LEAST, n_steps_until, paper_experiment
from control_field.parameters import Parameters
from experience_evaluation.experiment import Experiment, has_demonstration, LearningCurve
from experience_evaluation.starts import choose_places
from experience_evaluation.workers import run_all
from experience_evaluation.worlds import SMALL
from world_maps.world import load_world

#: Start and goal of the BARN worlds, [m], and how near to the start is judged.
BARN_START, BARN_GOAL, BARN_RADIUS = (-2.0, 3.0), (-2.0, 13.0), 0.5
DOC = Path(__file__).resolve().parent.parent / 'doc' / 'evaluation.md'
#: What field_success must be after 10 trials, by the beginning of a world's name, and how large
#: the worlds are that this was asked for, [cells].
LARGEST_ASKED = 32
FAMILIES = {'random': 0.90, 'room': 0.75, 'maze': 0.85}


@dataclass(frozen=True)
class Target:
    """
    A row of the table.

    Parameters
    ----------
    name : str
    value : float
        Measured; a median over the seeds unless the name says otherwise.
    must : float
        What it must be; NaN if nothing was asked for.
    at_most : bool
        Whether it must be so at most, else at least.
    spread : str
        Least and greatest value over the seeds.

    """

    name: str
    value: float
    must: float
    at_most: bool = False
    spread: str = ''

    def line(self) -> str:
        """Return the row as Markdown."""
        if math.isnan(self.must):
            return f'| {self.name} | {self.value:.4g} | {self.spread} | | |'
        good = self.value <= self.must if self.at_most else self.value >= self.must
        sign = '<=' if self.at_most else '>='
        return (f'| {self.name} | {self.value:.4g} | {self.spread} | {sign} {self.must:g} | '
                f'{"yes" if good else "**no**"} |')


def median(name: str, values: Sequence[float], must: float, at_most: bool = False) -> Target:
    """Return a row from the values of all seeds."""
    array = np.array(values, dtype=np.float64)
    return Target(name, float(np.median(array)), must, at_most,
                  f'{array.min():.4g} to {array.max():.4g}')


def tasks_on(path: Path, n_seeds: int) -> Tasks:
    """Return an experiment a seed on a world, goal and start drawn by the seed."""
    world = load_world(path, robot_radius=SMALL)
    tasks = []
    for seed in range(n_seeds):
        goal, start = choose_places(world.occupancy, np.random.default_rng(seed))
        tasks.append((Experiment(world.grid, world.occupancy, goal, [start], 0), seed))
    return tasks


def barn_tasks_on(path: Path, n_seeds: int) -> Tasks:
    """Return an experiment a seed on a BARN world."""
    world = load_world(path, robot_radius=SMALL)
    experiment = Experiment(
        world.grid, world.occupancy, world.grid.cell_from_world(*BARN_GOAL),
        [world.grid.cell_from_world(*BARN_START)], 0)
    return [(experiment, seed) for seed in range(n_seeds)]


def with_options(tasks: Tasks, **options: object) -> Tasks:
    """Return the tasks with other values in their experiments."""
    return [(replace(experiment, **options), seed)  # type: ignore[arg-type]
            for experiment, seed in tasks]


def at(curves: Sequence[LearningCurve], trials: int, name: str) -> list[float]:
    """Return a metric of all seeds after so many trials."""
    return [row[name] for curve in curves for row in curve.after if row['trials'] == trials]


def empty_rows(name: str, tasks: Tasks, n_jobs: int) -> list[Target]:
    """Measure an empty world without any trial."""
    curves = run_all(tasks, n_jobs, name)
    return [median(f'{name}, 0 trials, field_success', at(curves, 0, 'field_success'), 0.99)]


def family_rows(name: str, tasks: Tasks, n_jobs: int) -> list[Target]:
    """Measure worlds with obstacles over 30 trials."""
    curves = run_all(with_options(tasks, n_trials=30), n_jobs, name)
    musts = [next(must for family, must in FAMILIES.items() if name.startswith(family)),
             0.95, 0.99]
    if max(tasks[0][0].grid.shape) > LARGEST_ASKED:
        musts = [math.nan] * 3
    rows = [median(f'{name}, {k} trials, field_success', at(curves, k, 'field_success'), must)
            for k, must in zip((10, 20, 30), musts, strict=True)]
    worst = max(max(row['collisions'] for row in curve.after) for curve in curves)
    return [
        *rows,
        median(f'{name}, 30 trials, prototypes of the free cells',
               at(curves, 30, 'hidden_neurons_share'), 0.35, at_most=True),
        median(f'{name}, 10 trials, success', at(curves, 10, 'success'), 0.999),
        median(f'{name}, 10 trials, success_spl', at(curves, 10, 'success_spl'), 0.90),
        Target(f'{name}, collisions, worst', worst, 0, at_most=True)]


def detour_rows(name: str, tasks: Tasks, n_jobs: int) -> list[Target]:
    """Measure how faithful the field stays to a teacher who goes another way."""
    tasks = [task for task in with_options(tasks, n_trials=10, teacher='detour')
             if has_demonstration(*task)]
    if not tasks:
        return []  # no free detour in these few
    curves = run_all(tasks, n_jobs, f'{name} detour')
    return [median(f'{name}, detour teacher ({len(tasks)} seeds), {k} trials, fidelity',
                   at(curves, k, 'fidelity'), 0.95) for k in (0, 10)]


def barn_rows(name: str, tasks: Tasks, n_jobs: int) -> list[Target]:
    """Measure BARN worlds: blind teacher, five trials, starts near the start."""
    rows = []
    for starts in ('spread', 'fixed'):
        curves = run_all(with_options(tasks, n_trials=5, spread=starts == 'spread',
                                       teacher='blind', start_radius=BARN_RADIUS), n_jobs, name)
        worst = max(max(row['collisions'] for row in curve.after) for curve in curves)
        rows += [median(f'{name}, {starts} starts, success', at(curves, 5, 'success'), 0.95),
                 Target(f'{name}, {starts} starts, collisions, worst', worst, 0, True)]
    return rows


def n_reinforced(curve: LearningCurve) -> float:
    """Return the number of the last trial in which a reinforcement was used."""
    used = [k for k, row in enumerate(curve.after) if row['reinforcements'] > 0.0]
    return float(max(used, default=0))


def paper_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure the paper's two tasks: trials until no reinforcement is used any more."""
    rows = []
    for name in ('task1', 'task2'):
        for profile in ('full', 'paper'):
            experiment = paper_experiment(name, Parameters(profile=profile), n_trials=10)
            curves = run_all([(experiment, seed) for seed in range(n_seeds)], n_jobs, name)
            used = [n_reinforced(curve) for curve in curves]
            what = f"paper's {name}, profile {profile}, trials with reinforcements"
            rows += [median(f'{what}, median', used, 1, at_most=True),
                     Target(f'{what}, worst', max(used), 3, at_most=True)]
    return rows


def dyna_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure the Dyna maze: steps driven until a path of the least length is found."""
    curves = dyna_curves(n_seeds, n_jobs)
    steps = [n_steps_until(curve, 'greedy_steps', DYNA_LEAST) for curve in curves]
    rows = [
        Target(f'Dyna maze, steps until the greedy path of the Q-matrix is {DYNA_LEAST}, worst '
               f'seed', max(steps), 50, True, f'{min(steps):.4g} to {max(steps):.4g}'),
        median('Dyna maze, 12 trials, fidelity of the field', at(curves, 12, 'fidelity'), 0.95)]
    for starts in ('spread', 'fixed'):
        curves = dyna_curves(n_seeds, n_jobs, starts == 'spread', demonstration_advantage=0.0)
        within = [n_steps_until(curve, 'flow_steps', DYNA_LEAST) <= 50 for curve in curves]
        rows.append(Target(
            f'Dyna maze, demonstration advantage 0, {starts} starts: share of the seeds whose '
            f'field takes {DYNA_LEAST} steps within 50', float(np.mean(within)), math.nan))
    return rows


def rows_of(name: str, tasks: Tasks, n_jobs: int) -> list[Target]:
    """Measure all rows that worlds stand for, by the family they are named after."""
    if name.startswith('barn'):
        return barn_rows(name, tasks, n_jobs)
    if name.startswith('empty'):
        return empty_rows(name, tasks, n_jobs) + detour_rows(name, tasks, n_jobs)
    if name.startswith(tuple(FAMILIES)):
        return family_rows(name, tasks, n_jobs) + detour_rows(name, tasks, n_jobs)
    return []


def tasks_of(folder: Path | None, own: bool, n_seeds: int, only: str) -> dict[str, Tasks]:
    """Return the tasks that are measured, by name."""
    tasks: dict[str, Tasks] = {}
    for path in sorted(folder.iterdir()) if folder else []:
        if path.suffix in ('.map', '.yaml') and only in path.name:
            barn = path.suffix == '.yaml'
            name = path.stem if not barn or path.stem.startswith('barn') else f'barn, {path.stem}'
            tasks[name] = barn_tasks_on(path, n_seeds) if barn else tasks_on(path, n_seeds)
    if own:
        tasks |= {name: own_tasks(name, n_seeds) for name in OWN if only in name}
        if only in 'barn-like':
            tasks['barn-like'] = own_barn_tasks(n_seeds)
    return tasks


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, row by row as they come."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--worlds', type=Path, help='a folder of maps')
    parser.add_argument('--own', action='store_true', help='on worlds that are generated')
    parser.add_argument('--only', default='', help='only worlds whose name holds this')
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--write', action='store_true', help='write it into doc/evaluation.md')
    options = parser.parse_args(arguments)
    lines = ['| what | median | over the seeds | must | met |', '|---|---|---|---|---|']
    print('\n'.join(lines))
    measures: list[Callable[[], list[Target]]] = [
        partial(rows_of, name, tasks, options.jobs) for name, tasks in tasks_of(
            options.worlds, options.own, options.seeds, options.only).items()]
    if not options.only and not options.own:
        measures += [partial(paper_rows, 5 * options.seeds, options.jobs),
                     partial(dyna_rows, options.seeds, options.jobs)]
    for measure in measures:
        for row in measure():
            lines.append(row.line())
            print(row.line(), flush=True)
    if options.write:
        write_section(DOC, 'other maps' if options.own else 'how good', '\n'.join(lines))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
