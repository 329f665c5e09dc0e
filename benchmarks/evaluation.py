"""
Compare methods and switched-off parts: ``make evaluation``, results in ``doc/evaluation.md``.

Over our own seeded worlds; with ``WORLDS=folder`` (or ``--worlds folder``) over a folder of maps.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.evaluation_charts import draw_curves
from benchmarks.evaluation_tables import ablation_table, method_table, write_section
from control_field.grid import Grid
from control_field.parameters import Parameters
from experience_evaluation.experiment import Experiment, has_demonstration, LearningCurve
from experience_evaluation.methods.registry import METHODS
from experience_evaluation.starts import choose_places
from experience_evaluation.workers import run_all
from experience_evaluation.worlds import FAMILIES, generate, SMALL
from world_maps.world import load_world

DOC = Path(__file__).resolve().parent.parent / 'doc'
#: What is switched off, and how.
ABLATIONS: dict[str, dict[str, object]] = {
    'nothing (all of it)': {},
    'pull': {'pull': False}, 'visible windows': {'visible_windows': False},
    'rehearsal': {'rehearsal': False}, 'repair': {'repair': False},
    'pruning': {'pruning': False}, 'caution': {'caution': 0.0}, 'curiosity': {'curiosity': 0.0},
    'demonstration advantage': {'demonstration_advantage': 0.0},
    'practice advantage': {'practice_advantage': 0.0},
}
#: Methods of the comparison: name in the tables -> method and profile.
CANDIDATES = {'ours': ('ours', 'full'), 'ours, profile paper': ('ours', 'paper'),
              **{name: (name, 'full') for name in METHODS[1:]}}


@dataclass(frozen=True, eq=False)
class Setting:
    """
    A world with a goal and a start in it, for one seed.

    Parameters
    ----------
    family : str
        What it is counted under.
    seed : int
    grid : Grid
    occupancy : ndarray of int8, shape (n_rows, n_cols)
    goal, start : tuple of int
        ``(row, col)``

    """

    family: str
    seed: int
    grid: Grid
    occupancy: npt.NDArray[np.int8]
    goal: tuple[int, int]
    start: tuple[int, int]


#: Metrics of every seed: group -> world family -> curves.
Results = dict[str, dict[str, list[LearningCurve]]]


def own_settings(n_seeds: int, size: int) -> Iterator[Setting]:
    """Return worlds of our own generators, a new one for every seed."""
    for family in FAMILIES:
        for seed in range(n_seeds):
            yield _setting(family, seed, Grid(size, size, 1.0), generate(family, size, seed))


def folder_settings(folder: Path, n_seeds: int) -> Iterator[Setting]:
    """Return the worlds of a folder, goal and start drawn anew for every seed."""
    for path in sorted(folder.iterdir()):
        if path.suffix in ('.map', '.yaml'):
            world = load_world(path, robot_radius=SMALL)
            for seed in range(n_seeds):
                yield _setting(world.name, seed, world.grid, world.occupancy)


def _setting(family: str, seed: int, grid: Grid, occupancy: npt.NDArray[np.int8]) -> Setting:
    goal, start = choose_places(occupancy, np.random.default_rng(seed))
    return Setting(family, seed, grid, occupancy, goal, start)


def experiment_of(setting: Setting, n_trials: int, **options: object) -> Experiment:
    """Return the experiment of a setting; after few trials it is judged after each of them."""
    judged = tuple(k for k in range(n_trials + 1) if k <= 5 or k % 5 == 0 or k == n_trials)
    experiment = Experiment(setting.grid, setting.occupancy, setting.goal, [setting.start],
                            n_trials, judged_after=judged)
    return replace(experiment, **options)  # type: ignore[arg-type]


def compare(settings: Sequence[Setting], groups: dict[str, Callable[[Setting], Experiment]],
            n_jobs: int, title: str) -> Results:
    """Run every group of experiments on every setting."""
    keys = [(name, setting) for name in groups for setting in settings]
    curves = run_all([(groups[name](setting), setting.seed) for name, setting in keys], n_jobs,
                      title)
    results: Results = {name: {} for name in groups}
    for (name, setting), curve in zip(keys, curves, strict=True):
        results[name].setdefault(setting.family, []).append(curve)
    return results


def methods_of(n_trials: int, teacher: str) -> dict[str, Callable[[Setting], Experiment]]:
    """Return the experiments that compare methods."""
    def of(method: str, profile: str) -> Callable[[Setting], Experiment]:
        return lambda setting: experiment_of(
            setting, n_trials, method=method, teacher=teacher,
            parameters=Parameters(profile=profile))

    return {name: of(*candidate) for name, candidate in CANDIDATES.items()}


def ablations_of(n_trials: int, teacher: str) -> dict[str, Callable[[Setting], Experiment]]:
    """Return the experiments with a part switched off."""
    def of(values: dict[str, object]) -> Callable[[Setting], Experiment]:
        return lambda setting: replace(
            experiment_of(setting, n_trials, teacher=teacher,
                          parameters=Parameters.from_mapping(values)),
            judged_after=(0, n_trials))

    return {name: of(values) for name, values in ABLATIONS.items()}


def with_detours(settings: Sequence[Setting]) -> list[Setting]:
    """Return the settings in which the detour teacher finds another way."""
    return [setting for setting in settings if has_demonstration(
        experiment_of(setting, 0, teacher='detour'), setting.seed)]


#: What stands above the curves.
CAPTION = ('The curves are medians after each trial; the tint around *ours* is its 95 % '
           'interval, as in the table.')


def evaluate(settings: Sequence[Setting], name: str, n_trials: int, n_jobs: int) -> str:
    """Run everything on some worlds, draw the curves, and return the section of the document."""
    faithful = with_detours(settings)
    by_method = compare(settings, methods_of(n_trials, 'shortest'), n_jobs, 'methods')
    detoured = compare(faithful, methods_of(n_trials // 2, 'detour'), n_jobs, 'detour')
    charts = [draw_curves(by_method, metric, DOC / f'{name}_{metric}.png')
              for metric in ('field_success', 'success_spl')]
    few = n_trials // 2
    ablated = compare(settings, ablations_of(few, 'shortest'), n_jobs, 'ablations')
    bent = compare(faithful, ablations_of(few, 'detour'), n_jobs, 'ablations, detour')
    families = list(dict.fromkeys(setting.family for setting in settings))
    return '\n'.join([
        (f'Worlds: {", ".join(families)}; {len(settings)} settings in all, {n_trials} trials from '
         'spread starts. Medians over all of them, with bootstrap 95 % intervals.'), '',
        method_table(by_method, detoured), '',
        f'{CAPTION}\n', *[f'![{path.stem}]({path.name})\n' for path in charts],
        f'### Ablations, after {few} trials', '', ablation_table(ablated, bent)])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison and write it into the document."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--worlds', type=Path, default=os.environ.get('WORLDS') or None)
    parser.add_argument('--seeds', type=int, default=4)
    parser.add_argument('--size', type=int, default=24)
    parser.add_argument('--trials', type=int, default=20)
    parser.add_argument('--jobs', type=int, default=2)
    options = parser.parse_args(arguments)
    if options.worlds and not Path(options.worlds).is_dir():
        parser.exit(2, f'{parser.prog}: {options.worlds} is no folder of maps\n')
    settings = list(folder_settings(Path(options.worlds), options.seeds) if options.worlds
                    else own_settings(options.seeds, options.size))
    name = 'evaluation_worlds' if options.worlds else 'evaluation'
    section = evaluate(settings, name, options.trials, options.jobs)
    write_section(DOC / 'evaluation.md', 'worlds' if options.worlds else 'own', section)
    print(section)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
