"""
Measure what the robot makes of a world that changes: ``python -m benchmarks.changing_worlds``.

Over worlds of our own generators, another one for every seed; with ``--worlds FOLDER`` obstacles
are moved in MovingAI maps too. Each row says what was asked for.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.changing_charts import draw_changes, draw_mazes, stretches, STYLES
from benchmarks.changing_mazes import Arrived, MAZES, RUNNERS
from benchmarks.changing_tasks import (
    blocking_tasks, doors_tasks, HELD_OUT, held_out_tasks, moved_tasks, N_AFTER, N_EACH,
    N_PERSON_TRIALS, N_SHUT, N_TURNS, obstacle_tasks, persons_tasks, sealed_tasks, shortcut_tasks)
from benchmarks.evaluation_tables import write_section
from benchmarks.how_good import at, DOC, median, Target, tasks_on
from benchmarks.own_tasks import own_tasks, Tasks
from experience_evaluation.experiment import LearningCurve, Row
from experience_evaluation.workers import run, run_all

#: Runs of the mazes of Sutton and Barto.
N_RUNS: Final = 30
#: Worlds in which obstacles are moved: of our own, and by the name of a map.
MOVED: Final = ('random, 10 %, 32 x 32', 'rooms of 3, 32 x 32', 'maze of width 4, 32 x 32')
MOVED_MAPS: Final = ('random-32-32-10', 'room-32-32-4', 'maze-32-32-4')


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
    curves = run_all(blocking_tasks(n_seeds), n_jobs, name)
    return [
        median(f'{name}, success, worst trial after the change', worst_of(curves, 0, 'success'),
               0.99),
        median(f'{name}, field_success after 3 trials', after(curves, 0, 'field_success', 3),
               0.99),
        collided(name, curves)]


def shortcut_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure the shortcut maze: a gap opens where start and goal are."""
    rows = []
    for name, n, must, options in (
            ('spread starts', 5, 0.95, (True, False)),
            ('fixed starts, prefer_shorter', 10, 0.90, (False, True)),
            ('spread starts, prefer_shorter', 5, float('nan'), (True, True))):
        curves = run_all(shortcut_tasks(n_seeds, *options), n_jobs, name)
        rows += [median(f'shortcut maze, {name}, SPL of the field after {n} trials',
                        after(curves, 0, 'field_success_spl', n), must)]
    return rows


def sealed_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure a wall that is shut altogether for some trials, and opens again."""
    rows = []
    for name, spread in (('spread', True), ('fixed', False)):
        what = f'all shut for {N_SHUT} trials, then open, {name} starts'
        curves = run_all(sealed_tasks(n_seeds, spread), n_jobs, what)
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
                   float(np.mean(np.array(fidelity) == 1.0)), float('nan')),
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


def doors_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure rooms of which a third of the doors is shut, every few trials others."""
    what = 'doors shut and open'
    curves = run_all(doors_tasks(n_seeds), n_jobs, what)
    turns = range(N_TURNS)
    first, last = ([after(curves, turn, metric, n) for turn in turns]
                   for metric, n in (('success', 0), ('field_success', N_EACH)))
    return [
        median(f'{what}, success in the first trial after a change, worst change',
               min(first, key=np.median), 0.99),
        median(f'{what}, field_success after {N_EACH} trials, worst change',
               min(last, key=np.median), float('nan')), collided(what, curves)]


def held_out_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure what seeing farther is worth, on kinds of worlds that nothing was tuned on."""
    rows = []
    for name in HELD_OUT:
        for sight, must in ((3, float('nan')), (15, 0.95)):
            curves = run_all(held_out_tasks(name, sight, n_seeds), n_jobs, name)
            rows.append(median(f'{name}, 32 x 32, sight {sight} x {sight}, field_success after 3 '
                               f'trials', at(curves, 3, 'field_success'), must))
    return rows


def persons_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure five persons who cross the workspace, in the headless world."""
    what = 'five persons crossing, headless'
    curves = run_all(persons_tasks(n_seeds), n_jobs, what)
    contacts = [curve.after[-1]['mover_contacts'] for curve in curves]
    return [
        median(f'{what}, success of all trials', [
            float(np.mean([row['success'] for row in curve.after])) for curve in curves], 0.95),
        median(f'{what}, how often one ran into the robot in {N_PERSON_TRIALS} trials', contacts,
               float('nan')), collided(what, curves)]


def maze_rows(n_seeds: int, n_jobs: int) -> list[Target]:
    """Measure and draw the mazes of Sutton and Barto: how often the goal was reached."""
    del n_seeds  # 30 runs are what was asked for
    keys = [(name, who, seed) for name in MAZES for who in RUNNERS for seed in range(N_RUNS)]
    reached: dict[str, dict[str, list[Arrived]]] = {
        name: {who: [] for who in RUNNERS} for name in MAZES}
    for index, arrived in sorted(run(_arrived, keys, n_jobs, print), key=itemgetter(0)):
        name, who, _ = keys[index]
        reached[name][who].append(arrived)
    draw_mazes(reached, MAZES, DOC.with_name('evaluation_mazes.png'))
    return [_maze_row(name, who, [int(arrived[-1]) for arrived in reached[name][who]])
            for name in MAZES for who in RUNNERS]


def _arrived(name: str, who: str, seed: int) -> Arrived:
    return RUNNERS[who](MAZES[name], seed)


def _maze_row(name: str, who: str, values: list[int]) -> Target:
    return Target(
        f'Sutton and Barto, {name}, {who}, goals reached, mean of {N_RUNS} runs',
        float(np.mean(values)), MAZES[name].must if who == 'ours' else float('nan'),
        spread=f'{min(values)} to {max(values)}, standard deviation {np.std(values):.1f}')


Measure = Callable[[int, int], list[Target]]


def measures_of(folder: Path | None) -> dict[str, Measure]:
    """Return what is measured, by name: callables of the number of seeds and of jobs."""
    measures: dict[str, Measure] = {
        'blocking': blocking_rows, 'shortcut': shortcut_rows, 'sealed': sealed_rows,
        'obstacle': obstacle_rows, 'doors': doors_rows, 'sight': held_out_rows,
        'persons': persons_rows, 'mazes of the book': maze_rows}
    for name in MOVED:
        measures[f'moved, {name}'] = partial(moved_rows, name, partial(own_tasks, name))
    for path in () if folder is None else (folder / f'{name}.map' for name in MOVED_MAPS):
        measures[f'moved, {path.stem}'] = partial(moved_rows, path.stem, partial(tasks_on, path))
    return measures


#: Tasks that methods are compared in, by the title of their panel.
COMPARED: Final = {
    'blocking maze': blocking_tasks, 'shortcut maze': shortcut_tasks,
    'all shut, then open': sealed_tasks, 'doors': doors_tasks}


def compare(n_seeds: int, n_jobs: int) -> str:
    """Run every method on the tasks, draw the curves, and return them with a table."""
    results: dict[str, dict[str, list[LearningCurve]]] = {}
    for title, tasks in COMPARED.items():
        results[title] = {
            method: run_all([(replace(experiment, method=method), seed)
                             for experiment, seed in tasks(n_seeds)], n_jobs, f'{title}, {method}')
            for method in STYLES}
    charts = [draw_changes(results, metric, DOC.with_name(f'evaluation_changes_{metric}.png'))
              for metric in ('success', 'field_success_spl')]
    lines = ['| | ' + ' | '.join(label for *_, label in STYLES.values()) + ' |',
             '|---|' + '---|' * len(STYLES)]
    for title, by_method in results.items():
        for metric in ('success', 'field_success_spl'):
            values = [np.mean([row[metric] for curve in curves for stretch in stretches(curve)[1:]
                               for row in stretch]) for curves in by_method.values()]
            lines.append(f'| {title}, {metric} | ' + ' | '.join(
                f'{value:.3f}' for value in values) + ' |')
    return '\n'.join([
        *lines, '', (f'Means over the trials since the first change, {n_seeds} seeds each. The '
                     f'curves are medians.'), '',
        *(f'![{path.stem}]({path.name})\n' for path in charts),
        '![evaluation_mazes](evaluation_mazes.png)'])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, row by row as they come."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--worlds', type=Path, help='a folder of MovingAI maps')
    parser.add_argument('--only', default='', help='only what has this in its name')
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--methods', type=int, default=0, metavar='N',
                        help='compare methods too, over N seeds')
    parser.add_argument('--write', action='store_true', help='write it into doc/evaluation.md')
    options = parser.parse_args(arguments)
    lines = ['| what | median | over the seeds | must | met |', '|---|---|---|---|---|']
    print('\n'.join(lines))
    for name, measure in measures_of(options.worlds).items():
        for row in measure(options.seeds, options.jobs) if options.only in name else ():
            lines.append(row.line())
            print(row.line(), flush=True)
    if options.write:
        write_section(DOC, 'changing worlds', '\n'.join(
            [f'{options.seeds} seeds each.', '', *lines]))
    if options.methods:
        section = compare(options.methods, options.jobs)
        print(section)
        if options.write:
            write_section(DOC, 'changing worlds, methods', section)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
