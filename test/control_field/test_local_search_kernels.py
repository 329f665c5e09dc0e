"""Compiled rehearsal does what the robot's does, to the last bit."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np

from control_field.kernels import compiled
from control_field.kernels import steps as kernels
from control_field.local_grid import BLOCKED, FREE, UNKNOWN


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), rows=st.integers(1, 14), cols=st.integers(1, 14),
       n_backups=st.sampled_from([1, 3, 20, 400]), corner_cutting=st.booleans(),
       unknown_is_blocked=st.booleans(), moves=st.sampled_from([4, 8]))
def test_compiled_and_plain_rehearsal_agree(seed, rows, cols, n_backups, corner_cutting,
                                            unknown_is_blocked, moves):
    rng = np.random.default_rng(seed)
    known = rng.choice([FREE, FREE, BLOCKED, UNKNOWN], size=(rows, cols)).astype(np.int8)
    cost = np.where(rng.random((rows, cols)) < 0.1, np.inf, rng.random((rows, cols)) * 20.0)
    factor = np.where(known < 0, 1.2, 1.0)
    row, col, goal_row, goal_col = (int(rng.integers(n)) for n in (rows, cols, rows, cols))
    rules = (corner_cutting, unknown_is_blocked, moves)
    plain, fast = cost.copy(), cost.copy()
    arguments = (factor, row, col, goal_row, goal_col, n_backups, rules)
    kernels.rehearse_locally(known, plain, *arguments)
    compiled.rehearse_locally(known, fast, *arguments)
    np.testing.assert_array_equal(fast, plain)
