import math

from hypothesis import assume, given
from hypothesis import strategies as st
import pytest

from control_field.robot.footprint import (
    footprint_from_points, footprint_from_text, text_from_points)

BOX = '[[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]'
ELL = '[[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.0, -0.2], [0.0, 0.1], [0.3, 0.1]]'
numbers = st.floats(-1.0, 1.0)


def area(corners):
    following = [*corners[1:], corners[0]]
    return 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(corners, following, strict=True))


def star(radii):
    """Return corners around the middle, so far away each: no side crosses another."""
    return [(r * math.cos(k * math.tau / len(radii)), r * math.sin(k * math.tau / len(radii)))
            for k, r in enumerate(radii)]


stars = st.lists(st.floats(0.05, 1.0), min_size=4, max_size=12).map(star)


def test_as_nav2_writes_it_in_either_sense():
    for text in (BOX, '[ [0.3,0.2], [0.3,-0.2],[-.3,-0.20], [-3e-1, .2] ]'):
        found = footprint_from_text(text)
        assert found.circumscribed == pytest.approx(math.hypot(0.3, 0.2))
        assert found.inscribed == pytest.approx(0.2)
        assert area(found.corners) == pytest.approx(0.24)
    assert footprint_from_text(' ') is None


@pytest.mark.parametrize(('text', 'said'), [
    ('[]', 'at least three points'), ('[[0.3, 0.2]]', '0 corners'), ('0.3, 0.2', 'three points'),
    ('[[0.3, 0.2], [0.1, nan], [0, 0]]', 'three points'), ('[[1, 2, 3], [1, 2], [2, 3]]', 'three'),
    ('[[0, 0], [1, 1], [1, 0], [0, 1]]', 'cross'), ('[[0, 0], [1, 0], [0.5, 0]]', 'cross'),
    ('[[30, 20], [-30, 20], [-30, -20], [30, -20]]', 'metres'),
    ('[[0, 0], [1, 0], [0.5, 0], [0.5, 1]]', 'cross'), ('x' * 500, '...')])
def test_what_is_no_outline_is_refused(text, said):
    with pytest.raises(ValueError, match=r'^footprint is ') as error:
        footprint_from_text(text)
    assert said in str(error.value)


def test_a_middle_outside_has_no_inscribed_disc():
    found = footprint_from_text('[[0.1, -0.1], [0.5, -0.1], [0.5, 0.1], [0.1, 0.1]]')
    assert found.inscribed == 0.0
    assert not found.holds(0.0, 0.0)
    assert found.holds(0.3, 0.0)


def test_a_corner_that_goes_in_is_not_part_of_it():
    found = footprint_from_text(ELL)
    assert len(found.pieces) > 1
    assert not found.holds(0.2, 0.0)
    assert found.holds(-0.2, -0.1)
    assert found.holds(0.2, 0.15)


@given(stars)
def test_its_pieces_are_convex_and_as_large_as_it(corners):
    found = footprint_from_points(corners)
    assert sum(area(piece.corners) for piece in found.pieces) == pytest.approx(area(found.corners))
    for piece in found.pieces:
        for nx, ny, d in piece.sides:
            assert all(nx * x + ny * y <= d + 1e-9 for x, y in piece.corners)


@given(stars, numbers, numbers)
def test_a_point_is_on_it_as_the_angles_around_the_point_say(corners, x, y):
    found = footprint_from_points(corners)
    assume(all(abs((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) > 1e-9
               for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)))
    turns = 0.0
    for a, b in zip(found.corners, [*found.corners[1:], found.corners[0]], strict=True):
        first, second = math.atan2(a[1] - y, a[0] - x), math.atan2(b[1] - y, b[0] - x)
        turn = math.remainder(second - first, math.tau)
        turns += turn
    assert found.holds(x, y) == (abs(turns) > math.pi)


@given(stars)
def test_it_lies_between_its_two_discs(corners):
    found = footprint_from_points(corners)
    assert found.inscribed <= min(math.hypot(*corner) for corner in corners) + 1e-12
    for k in range(32):
        angle = k * math.tau / 32
        inside = 0.999 * found.inscribed
        assert found.holds(inside * math.cos(angle), inside * math.sin(angle))
    assert text_from_points(found.corners).count('], [') == len(found.corners) - 1
