"""
Measure how good the method is, row by row: ``python -m benchmarks.how_good --worlds FOLDER``.

For any folder of maps: MovingAI maps are sorted into families by their name (empty, random, room,
maze), map_server maps are taken for BARN worlds. Goal and start are drawn anew for every seed.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.evaluation_tables import write_section
from benchmarks.paper_tasks import dyna_steps, paper_experiment
from control_field.parameters import Parameters
from experience_cli.evaluation.experiment import (
    Course, Experiment, has_demonstration, run_all)
from experience_cli.evaluation.places import choose_places
from sim_node.world import load_world

#: Start and goal of the BARN worlds, [m], and how near to the start is judged.
BARN_START, BARN_GOAL, BARN_RADIUS = (-2.0, 3.0), (-2.0, 13.0), 0.5
DOC = Path(__file__).resolve().parent.parent / 'doc' / 'evaluation.md'
FAMILIES = ('random', 'room', 'maze')


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
        What it must be.
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
        good = self.value <= self.must if self.at_most else self.value >= self.must
        sign = '<=' if self.at_most else '>='
        return (f'| {self.name} | {self.value:.4g} | {self.spread} | {sign} {self.must:g} | '
                f'{"yes" if good else "**no**"} |')


def median(name: str, values: Sequence[float], must: float, at_most: bool = False) -> Target:
    """Return a row from the values of all seeds."""
    array = np.array(values, dtype=np.float64)
    return Target(name, float(np.median(array)), must, at_most,
                  f'{array.min():.4g} to {array.max():.4g}')


def tasks_on(path: Path, n_seeds: int, **options: object) -> list[tuple[Experiment, int]]:
    """Return an experiment a seed on a world, goal and start drawn by the seed."""
    world = load_world(path)
    tasks = []
    for seed in range(n_seeds):
        goal, start = choose_places(world.occupancy, np.random.default_rng(seed))
        experiment = Experiment(world.grid, world.occupancy, goal, [start], 0)
        tasks.append((replace(experiment, **options), seed))  # type: ignore[arg-type]
    return tasks


def at(courses: Sequence[Course], trials: int, name: str) -> list[float]:
    """Return a metric of all seeds after so many trials."""
    return [course.after[trials][name] for course in courses]


def empty_rows(path: Path, n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure an empty world without any trial."""
    courses = run_all(tasks_on(path, n_seeds), n_jobs, path.stem)
    return [median(f'{path.stem}, 0 trials, field_success', at(courses, 0, 'field_success'), 0.99)]


def family_rows(path: Path, family: str, n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure a world with obstacles over 30 trials."""
    courses = run_all(tasks_on(path, n_seeds, n_trials=30), n_jobs, path.stem)
    first = {'random': 0.90, 'room': 0.75, 'maze': 0.85}[family]
    rows = [median(f'{path.stem}, {k} trials, field_success', at(courses, k, 'field_success'),
                   must) for k, must in ((10, first), (20, 0.95), (30, 0.99))]
    worst = max(max(row['collisions'] for row in course.after) for course in courses)
    return [
        *rows,
        median(f'{path.stem}, 30 trials, prototypes of the free cells',
               at(courses, 30, 'hidden_neurons_share'), 0.35, at_most=True),
        median(f'{path.stem}, 10 trials, success', at(courses, 10, 'success'), 0.999),
        median(f'{path.stem}, 10 trials, success_spl', at(courses, 10, 'success_spl'), 0.90),
        Target(f'{path.stem}, collisions, worst', worst, 0, at_most=True)]


def detour_rows(path: Path, n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure how faithful the field stays to a teacher who goes another way."""
    tasks = [task for task in tasks_on(path, n_seeds, n_trials=10, teacher='detour')
             if has_demonstration(*task)]
    courses = run_all(tasks, n_jobs, f'{path.stem} detour')
    return [median(f'{path.stem}, detour teacher ({len(tasks)} seeds), {k} trials, fidelity',
                   at(courses, k, 'fidelity'), 0.95) for k in (0, 10)]


def barn_rows(path: Path, n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure a BARN world: blind teacher, five trials, starts near the start."""
    world = load_world(path)
    rows = []
    for starts in ('spread', 'fixed'):
        experiment = Experiment(
            world.grid, world.occupancy, world.grid.cell_from_world(*BARN_GOAL),
            [world.grid.cell_from_world(*BARN_START)], 5, starts == 'spread', 'blind',
            start_radius=BARN_RADIUS)
        courses = run_all([(experiment, seed) for seed in range(n_seeds)], n_jobs, path.stem)
        worst = max(max(row['collisions'] for row in course.after) for course in courses)
        rows += [median(f'{path.stem}, {starts} starts, success', at(courses, 5, 'success'), 0.95),
                 Target(f'{path.stem}, {starts} starts, collisions, worst', worst, 0, True)]
    return rows


def n_reinforced(course: Course) -> float:
    """Return the number of the last trial in which a reinforcement was used."""
    used = [k for k, row in enumerate(course.after) if row['reinforcements'] > 0.0]
    return float(max(used, default=0))


def paper_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure the paper's two tasks: trials until no reinforcement is used any more."""
    rows = []
    for name in ('task1', 'task2'):
        for profile in ('full', 'paper'):
            experiment = paper_experiment(name, Parameters(profile=profile), n_trials=10)
            courses = run_all([(experiment, seed) for seed in range(n_seeds)], n_jobs, name)
            used = [n_reinforced(course) for course in courses]
            what = f"paper's {name}, profile {profile}, trials with reinforcements"
            rows += [median(f'{what}, median', used, 1, at_most=True),
                     Target(f'{what}, worst', max(used), 3, at_most=True)]
    return rows


def dyna_rows(n_seeds: int) -> list[Target]:
    """Measure the Dyna maze: steps driven until the greedy path has 14 steps."""
    steps = [dyna_steps(seed) for seed in range(n_seeds)]
    return [Target(f'Dyna maze, steps until the greedy path of the {name} is 14, worst seed',
                   max(values), 50, True, f'{min(values):.4g} to {max(values):.4g}')
            for name, values in zip(('Q-matrix', 'field'), zip(*steps, strict=True), strict=True)]


def rows_of(path: Path, n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure all rows that a map file stands for."""
    if path.suffix == '.yaml':
        return barn_rows(path, n_seeds, n_jobs)
    if path.stem.startswith('empty'):
        return empty_rows(path, n_seeds, n_jobs) + detour_rows(path, n_seeds, n_jobs)
    for family in FAMILIES:
        if path.stem.startswith(family):
            return (family_rows(path, family, n_seeds, n_jobs)
                    + detour_rows(path, n_seeds, n_jobs))
    return []


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, row by row as they come."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--worlds', type=Path, help='a folder of maps')
    parser.add_argument('--only', default='', help='only files whose name holds this')
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--write', action='store_true', help='write it into doc/evaluation.md')
    options = parser.parse_args(arguments)
    lines = ['| what | median | over the seeds | must | met |', '|---|---|---|---|---|']
    print('\n'.join(lines))
    paths = sorted(options.worlds.iterdir()) if options.worlds else []
    measures: list[Callable[[], list[Target]]] = [
        lambda path=path: rows_of(path, options.seeds, options.jobs)  # type: ignore[misc]
        for path in paths if path.suffix in ('.map', '.yaml') and options.only in path.name]
    if not options.only:
        measures += [lambda: paper_rows(5 * options.seeds, options.jobs),
                     lambda: dyna_rows(options.seeds)]
    for measure in measures:
        for row in measure():
            lines.append(row.line())
            print(row.line(), flush=True)
    if options.write:
        write_section(DOC, 'how good', '\n'.join(lines))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
