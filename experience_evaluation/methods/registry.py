"""The methods by name."""

from typing import Final

import numpy as np

from experience_evaluation.methods.behaviour_cloning import NearestPrototype
from experience_evaluation.methods.method import equation_7, FieldMethod, Method, Task
from experience_evaluation.methods.replanner import Replanner
from experience_evaluation.methods.tabular import KINDS, TabularMethod

_WITH_DEMONSTRATION: Final = '+demo'
#: Every name that `make_method` takes, the own method first.
METHODS: Final = (
    'ours', *(name + ending for name in KINDS for ending in ('', _WITH_DEMONSTRATION)),
    'nearest_prototype', 'eq7', 'replanner', 'forgetting_replanner')


def make_method(name: str, task: Task, rng: np.random.Generator) -> Method:
    """
    Return a method that was not taught anything yet.

    Raises
    ------
    ValueError
        If there is no method of that name.

    """
    kind = name.removesuffix(_WITH_DEMONSTRATION)
    if kind in KINDS:
        return TabularMethod(task, rng, KINDS[kind], name != kind)
    if name == 'ours':
        return FieldMethod(task, rng)
    if name == 'eq7':
        return equation_7(task, rng)
    if name == 'nearest_prototype':
        return NearestPrototype(task)
    if name in ('replanner', 'forgetting_replanner'):
        return Replanner(task, rng, name != 'replanner')
    raise ValueError(f'there is no method {name}, there are: {", ".join(METHODS)}')
