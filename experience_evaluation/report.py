"""From seeds to medians with intervals, and to the JSON report."""

from collections.abc import Sequence
from dataclasses import asdict
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from experience_evaluation.experiment import Experiment, LearningCurve
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
    Return the report as JSON takes it: ``config`` and ``after``.

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
    after = [{'trials': int(rows[0]['trials']),
              **{name: summarise([row[name] for row in rows]) for name in METRICS}}
             for rows in zip(*(curve.after for curve in curves), strict=True)]
    config = _config(experiment, [curve.seed for curve in curves], world, demo_bag)
    return {'config': {**config, 'lost_seeds': list(lost)}, 'after': after}


def _config(experiment: Experiment, seeds: list[int], world: str, demo_bag: str | None,
            ) -> dict[str, Any]:
    grid = experiment.grid
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
        'n_starts': int(experiment.judged().sum()),
        'n_free': int((experiment.occupancy == 0).sum()),
        'n_reachable': int(experiment.reachable().sum()), 'parameters': parameters}
