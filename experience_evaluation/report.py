"""From seeds to medians with intervals, and to the JSON report."""

from collections.abc import Sequence
from dataclasses import asdict
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from experience_evaluation.environment import Environment
from experience_evaluation.experiment import Experiment, LearningCurve, Row
from experience_evaluation.metrics import METRICS

_N_RESAMPLES = 2000
_LEVEL = 0.95


def interval_of_median(values: npt.NDArray[np.float64]) -> tuple[float, float]:
    """
    Return the bootstrap 95 % interval of a median (percentile method, always the same draws).

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite, at least one.

    """
    rng = np.random.default_rng(0)
    draws = values[rng.integers(len(values), size=(_N_RESAMPLES, len(values)))]
    tail = 50.0 * (1.0 - _LEVEL)
    low, high = np.percentile(np.median(draws, axis=1), [tail, 100.0 - tail])
    return float(low), float(high)


def summarise(values: Sequence[float]) -> dict[str, Any]:
    """Return median, interval and the values themselves; None stands for a value not defined."""
    array = np.array(values, dtype=np.float64)
    defined = array[np.isfinite(array)]
    listed = [float(value) if math.isfinite(value) else None for value in array]
    if len(defined) == 0:
        return {'median': None, 'low': None, 'high': None, 'values': listed}
    low, high = interval_of_median(defined)
    return {'median': float(np.median(defined)), 'low': low, 'high': high, 'values': listed}


def report(experiment: Experiment, curves: Sequence[LearningCurve], world: str,
           demo_bag: str | None = None, lost: Sequence[int] = ()) -> dict[str, Any]:
    """
    Return the report as JSON takes it: ``config``, ``after`` and ``at_changes``.

    Parameters
    ----------
    experiment : Experiment
    curves : sequence of LearningCurve
        One a seed, in any order.
    world : str
        The file, as the user named it.
    demo_bag : str, optional
        The bag the demonstration came from.
    lost : sequence of int
        Seeds that came to nothing, because their process was killed again and again.

    """
    curves = sorted(curves, key=lambda curve: curve.seed)
    config = _config(experiment, [curve.seed for curve in curves], world, demo_bag)
    changed = _entries([curve.at_changes for curve in curves])
    return {
        'config': {**config, 'lost_seeds': list(lost)},
        'after': _entries([curve.after for curve in curves]),
        'at_changes': [{**entry, 'world': change.world} for entry, change in zip(
            changed, experiment.changes, strict=True)]}


def _entries(rows_of_seeds: Sequence[Sequence[Row]]) -> list[dict[str, Any]]:
    return [{'trials': int(rows[0]['trials']),
             **{name: summarise([row[name] for row in rows]) for name in METRICS}}
            for rows in zip(*rows_of_seeds, strict=True)]


def _config(experiment: Experiment, seeds: list[int], world: str, demo_bag: str | None,
            ) -> dict[str, Any]:
    grid, (first, *changed) = experiment.grid, experiment.environments()
    parameters = {name: value for name, value in asdict(experiment.parameters).items()
                  if name != 'seed'}
    return {
        'world': world, 'n_rows': grid.n_rows, 'n_cols': grid.n_cols,
        'resolution': grid.resolution, 'origin': [grid.origin_x, grid.origin_y],
        'goal': list(grid.world_from_cell(*experiment.goal)),
        'demo_starts': [list(grid.world_from_cell(*cell)) for cell in experiment.demo_starts],
        'teacher': 'bag' if demo_bag else experiment.teacher, 'demo_bag': demo_bag,
        'demo_steps': experiment.demo_steps,
        'method': experiment.method, 'profile': experiment.parameters.profile,
        'starts': 'spread' if experiment.spread else 'fixed', 'trials': experiment.n_trials,
        'start_radius': (experiment.start_radius if math.isfinite(experiment.start_radius)
                         else None),
        'seeds': seeds, 'corner_cutting': experiment.parameters.corner_cutting,
        **_counts(experiment, first), 'parameters': parameters,
        'sight': experiment.sight, 'n_movers': len(experiment.script.movers),
        'changes': [{'after': change.after, 'world': change.world, **_counts(experiment, then)}
                    for change, then in zip(experiment.changes, changed, strict=True)]}


def _counts(experiment: Experiment, environment: Environment) -> dict[str, int]:
    return {'n_starts': int(experiment.judged(environment).sum()),
            'n_free': int((environment.world.truth == 0).sum()),
            'n_reachable': int(environment.reachable.sum())}
