import math

from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
import numpy as np
import pytest
from scipy.spatial import ConvexHull, KDTree
from scipy.spatial.distance import cdist

from control_field.headings import UNIT
from control_field.learning.interpolation import interpolate, weight_from_q
from strategies import steady

powers = st.floats(0.5, 16.0)
numbers = st.integers(-50, 50).map(lambda k: k / 4)


@st.composite
def networks(draw, low=1):
    """Return points, centres (all different), actions and weights."""
    n, m = draw(st.integers(low, 12)), draw(st.integers(1, 6))
    centres = draw(st.lists(st.tuples(numbers, numbers), min_size=n, max_size=n, unique=True))
    points = draw(hnp.arrays(float, (m, 2), elements=numbers))
    actions = UNIT[draw(st.lists(st.integers(0, 7), min_size=n, max_size=n))]
    weights = draw(hnp.arrays(float, n, elements=st.floats(0.01, 1.0)))
    return points, np.array(centres), actions, weights


def by_the_book(points, centres, actions, weights, power, window=np.inf):
    """Equation 7 as it is printed, by a k-d tree's windows."""
    out = []
    tree = KDTree(centres)
    for point in points:
        d, nearest = tree.query(point)
        if d == 0.0:
            out.append(actions[nearest])
            continue
        inside = [i for i in range(len(centres))
                  if np.hypot(*(centres[i] - point)) <= max(window, d)]
        w = weights[inside] / cdist([point], centres[inside])[0] ** power
        out.append((w[:, None] * actions[inside]).sum(axis=0) / w.sum())
    return np.array(out)


@given(networks(), powers, st.floats(0.5, 20.0) | st.just(np.inf))
@steady
def test_it_is_equation_7(network, power, window):
    assert np.allclose(interpolate(*network, power, window),
                       by_the_book(*network, power, window), atol=1e-9)


@given(networks(), powers)
@steady
def test_with_equal_weights_it_is_equation_3(network, power):
    points, centres, actions, weights = network
    equal = np.ones(len(weights))
    assert np.allclose(interpolate(points, centres, actions, equal, power),
                       interpolate(points, centres, actions, 0.3 * equal, power), atol=1e-12)


@given(networks(), powers, st.floats(0.5, 20.0))
@steady
def test_on_a_centre_it_is_the_action_to_the_bit(network, power, window):
    _, centres, actions, weights = network
    assert np.array_equal(interpolate(centres, centres, actions, weights, power, window), actions)


@given(networks(low=3), powers)
@steady
def test_it_is_a_convex_combination_of_the_actions(network, power):
    points, centres, actions, weights = network
    out = interpolate(points, centres, actions, weights, power)
    assert (out >= actions.min(axis=0) - 1e-12).all()
    assert (out <= actions.max(axis=0) + 1e-12).all()
    assert (np.hypot(*out.T) <= 1.0 + 1e-12).all()
    assume(len(np.unique(actions, axis=0)) >= 3)
    hull = ConvexHull(np.unique(actions, axis=0))
    assert (hull.equations[:, :2] @ out.T + hull.equations[:, 2:] <= 1e-9).all()


@given(networks(), powers, st.floats(1e-6, 1e6))
@steady
def test_the_scale_of_Q_does_not_matter(network, power, scale):
    points, centres, actions, q = network
    signed = q - 0.5
    assert np.allclose(weight_from_q(scale * signed, 0.05), weight_from_q(signed, 0.05))
    assert np.allclose(interpolate(points, centres, actions, scale * q, power),
                       interpolate(points, centres, actions, q, power), atol=1e-9)


@given(networks(), powers, st.floats(0.0, 6.3), st.tuples(numbers, numbers),
       st.floats(0.01, 100.0))
@steady
def test_it_turns_moves_and_grows_with_the_workspace(network, power, angle, shift, scale):
    points, centres, actions, weights = network
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    hit = (cdist(points, centres) == 0.0).any(axis=1)  # an exact hit is exact no longer
    out = interpolate(points, centres, actions, weights, power)
    turned = interpolate(scale * (points @ turn) + shift, scale * (centres @ turn) + shift,
                         actions @ turn, weights, power)
    assert np.allclose(turned[~hit], (out @ turn)[~hit], atol=1e-6)


@given(networks(), powers, st.floats(0.5, 20.0), st.floats(0.01, 100.0))
@steady
def test_the_window_grows_with_the_workspace(network, power, window, scale):
    points, centres, actions, weights = network
    d = cdist(points, centres)
    assume((np.abs(d - window) > 1e-6).all())
    assert np.allclose(
        interpolate(scale * points, scale * centres, actions, weights, power, scale * window),
        interpolate(points, centres, actions, weights, power, window), atol=1e-9)


def test_the_window_leaves_out_what_is_farther_and_never_everything():
    centres, actions = np.array([[0.0, 0.0], [3.0, 0.0], [9.0, 0.0]]), UNIT[[0, 2, 4]]
    weights = np.ones(3)
    near = interpolate(np.array([[1.0, 0.0]]), centres, actions, weights, 2.0, 2.0)
    assert np.allclose(near, (actions[0] + actions[1] / 4) / 1.25)
    alone = interpolate(np.array([[30.0, 0.0]]), centres, actions, weights, 2.0, 1.0)
    assert np.array_equal(alone[0], actions[2])


@pytest.mark.parametrize('power', [0.5, 2.0, 16.0, 500.0])
@pytest.mark.parametrize('unit', [1e-150, 1e-30, 1.0, 1e30, 1e150])
def test_neither_tiny_nor_huge_distances_nor_powers_break_it(power, unit):
    centres = unit * np.array([[0.0, 0.0], [1.0, 0.0], [1e3, 1e3]])
    points = unit * np.array([[1e-3, 0.0], [0.5, 0.0], [1e6, -1e6]])
    out = interpolate(points, centres, UNIT[[0, 2, 4]], np.array([1e-6, 1.0, 0.5]), power)
    assert np.isfinite(out).all()
    assert (np.hypot(*out.T) <= 1.0 + 1e-12).all()


def test_without_prototypes_there_is_no_field():
    with pytest.raises(ValueError, match='at least one prototype'):
        interpolate(np.zeros((1, 2)), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), 2.0)


@given(hnp.arrays(float, st.integers(1, 10), elements=st.floats(-100, 100)),
       st.floats(1e-6, 1.0))
@steady
def test_weights_are_positive_monotone_and_bounded(q, floor):
    weights = weight_from_q(q, floor)
    assert (weights >= floor * (1 - 1e-12)).all()
    assert (weights <= 1.0 + 1e-12).all()
    order = np.argsort(q)
    assert (np.diff(weights[order]) >= -1e-12).all()
    assert weights[order[-1]] == pytest.approx(1.0)


def test_weights_of_nothing_and_of_equals():
    assert weight_from_q(np.zeros(0), 0.1).shape == (0,)
    assert weight_from_q(np.full(3, -2.0), 0.1).tolist() == [1.0] * 3
    assert weight_from_q(np.array([0.0, 1.0]), 0.1).tolist() == [0.1, 1.0]
    assert weight_from_q(np.array([-1.0, 1.0]), 0.1).tolist() == [0.1, 1.0]
