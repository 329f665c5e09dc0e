"""The Q-matrix says what is good, the field what was shown."""

import numpy as np

from control_field.grid import Grid
from control_field.headings import headings_from_vectors
from control_field.kernels import compiled
from control_field.kernels.steps import StepRules
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import Demonstration

#: A detour over the top of an open workspace, from (1, 0) to (1, 6).
DETOUR = [(1, 0), (2, 0), (3, 1), (3, 2), (3, 3), (3, 4), (3, 5), (2, 6), (1, 6)]
RULES = StepRules(False, False, 8)


def refreshed():
    cells = np.array(DETOUR, dtype=np.int32)
    n = len(cells)
    learner = Learner(Grid(5, 7, 1.0), Parameters())
    return learner.add_demonstration(Demonstration(
        cells, np.arange(n, dtype=float), np.zeros(n, np.uint8), np.zeros(n, np.uint8)))


def test_the_field_keeps_the_detour_and_the_q_matrix_knows_better():
    field = refreshed().field
    shown = compiled.flow_reaches(
        field.known, headings_from_vectors(field.vx, field.vy), *DETOUR[0], *DETOUR[-1], RULES)
    greedy = compiled.flow_reaches(
        field.known, field.q.argmax(axis=2).astype(np.int8), *DETOUR[0], *DETOUR[-1], RULES)
    assert (shown, greedy) == (len(DETOUR) - 1, 6)


def test_a_prototype_has_the_q_value_of_the_matrix():
    refresh = refreshed()
    prototypes = refresh.prototypes
    np.testing.assert_allclose(
        prototypes.q, refresh.field.q[(*prototypes.cells.T, prototypes.headings)], rtol=1e-6)
