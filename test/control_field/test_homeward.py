"""Where a field leads home: the same cells, whether loops are compiled or NumPy finds them."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.headings import headings_from_vectors, UNIT
from control_field.homeward import leads_home
from control_field.kernels.rollout import flow_basin
from control_field.kernels.steps import StepRules
from control_field.records import ControlField


def field_of(rng, shape, blocked):
    """Return a field that points anywhere, on a map with free, doubted, unknown and blocked."""
    headings = rng.integers(-1, 8, shape)
    vectors = np.where(headings[..., None] < 0, 0.0, np.asarray(UNIT)[headings])
    known = rng.choice([0, 0, 0, -1, 40, 100], shape).astype(np.int8)
    known[rng.random(shape) < blocked] = 100
    return ControlField(
        Grid(*shape, 0.25), 1, (int(rng.integers(shape[0])), int(rng.integers(shape[1]))),
        vectors[..., 0].astype(np.float32), vectors[..., 1].astype(np.float32),
        np.zeros(shape, np.float32), np.zeros((*shape, 8), np.float32), known,
        np.zeros(shape, np.uint8))


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 9), cols=st.integers(1, 9),
       blocked=st.sampled_from([0.0, 0.2]), corner_cutting=st.booleans(),
       unknown_is_blocked=st.booleans(), moves=st.sampled_from([4, 8]))
def test_it_finds_what_following_cell_by_cell_finds(
        seed, rows, cols, blocked, corner_cutting, unknown_is_blocked, moves):
    field = field_of(np.random.default_rng(seed), (rows, cols), blocked)
    rules = StepRules(corner_cutting, unknown_is_blocked, moves)
    state = flow_basin(
        field.known, headings_from_vectors(field.vx, field.vy), *field.goal, rules)
    np.testing.assert_array_equal(leads_home(field, rules), state == 1)


@pytest.mark.parametrize('length', [1, 2, 63, 64, 65, 1000])
def test_a_way_of_any_length_is_followed_to_its_end(length):
    shape = (1, length)
    field = ControlField(
        Grid(*shape, 0.25), 1, (0, length - 1), np.ones(shape, np.float32),
        np.zeros(shape, np.float32), np.ones(shape, np.float32),
        np.zeros((*shape, 8), np.float32), np.zeros(shape, np.int8), np.zeros(shape, np.uint8))
    assert leads_home(field, StepRules(False, False, 8)).all()
