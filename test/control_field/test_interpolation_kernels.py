"""The attraction and the averaging of eq. 7, cell by cell, against what the words say."""

import math

from hypothesis import given
import numpy as np
import pytest

from control_field.headings import heading_from_vector, STEP_COL, STEP_LENGTH, STEP_ROW, UNIT
from control_field.kernels import interpolation, repair
from control_field.kernels import steps as kernels
from control_field.kernels.interpolation import Attraction, Sums, Vectors, View
from control_field.kernels.steps import plain_ground, StepRules
from kernel_scenes import Scene
from oracles import turn_between
from strategies import knowns, rules, seeds, steady

BODY = StepRules(False, False, 8)


def steps(known, cell, rule):
    """Return the allowed steps from a cell: heading and the cell they lead to."""
    return [(h, (cell[0] + int(STEP_ROW[h]), cell[1] + int(STEP_COL[h])))
            for h in range(8) if kernels.step_allowed(known, *cell, h, rule)]


@given(knowns, rules, seeds)
@steady
def test_the_attraction_is_the_cheapest_step_and_of_equals_the_nearest_to_the_heading(
        known, rule, seed):
    scene = Scene(known, rule, seed)
    attraction = interpolation.attraction_from_cost(scene.ground, scene.cost, scene.sums)
    for cell in np.ndindex(known.shape):
        ways = {h: scene.cost[to] + STEP_LENGTH[h] * scene.ground.factor[to]
                for h, to in steps(known, cell, rule) if np.isfinite(scene.cost[to])}
        if kernels.is_occupied(known, *cell, rule[1]) or scene.cost[cell] == 0.0 or not ways:
            assert attraction[cell] == -1
            continue
        cheapest = [h for h, cost in ways.items() if cost <= min(ways.values()) + 1e-9]
        assert attraction[cell] in cheapest
        heading = heading_from_vector(scene.sums.x[cell], scene.sums.y[cell])
        assert turn_between(int(attraction[cell]), heading) == min(
            turn_between(h, heading) for h in cheapest)


@given(knowns, rules, seeds)
@steady
def test_without_rehearsal_the_attraction_points_straight_to_the_nearest_centre(known, rule, seed):
    scene = Scene(known, rule, seed)
    attraction = interpolation.attraction_to_nearest(known, scene.cells, rule)
    for row, col in np.ndindex(known.shape):
        off = scene.cells - (row, col)
        d_row, d_col = off[int(np.hypot(*off.T).argmin())]
        heading = heading_from_vector(float(d_col), float(d_row))
        allowed = heading >= 0 and kernels.step_allowed(known, row, col, heading, rule)
        assert attraction[row, col] == (heading if allowed else -1)


@given(knowns, seeds)
@steady
def test_the_attraction_is_one_more_voice_in_the_average(known, seed):
    scene = Scene(known, BODY, seed)
    sums = scene.sums._replace(weight=scene.sums.weight + 1.0)
    for cell in np.ndindex(known.shape):
        vector = np.array([sums.x[cell], sums.y[cell]])
        weight, heading = sums.weight[cell], scene.headings[cell]
        if heading >= 0:
            vector, weight = vector + 2.5 * UNIT[heading], weight + 2.5
        assert interpolation.mean_vector(
            *cell, sums, Attraction(scene.headings, 2.5)) == pytest.approx(tuple(vector / weight))


def test_where_nobody_has_a_say_there_is_no_course():
    nothing, silent = Sums.none((1, 2)), Attraction(np.full((1, 2), -1, np.int8), 2.0)
    assert interpolation.mean_vector(0, 0, nothing, silent) == (0.0, 0.0)
    centre = np.array([[3, -1]], np.int8)
    made = Vectors.none((1, 2))
    interpolation.field_vectors(nothing, centre, silent, made, np.ones((1, 2), bool))
    assert made.headings.tolist() == [[3, -1]]
    assert (made.x[0, 0], made.y[0, 0]) == tuple(UNIT[3])
    assert (made.x[0, 1], made.y[0, 1]) == (0.0, 0.0)


@given(knowns, seeds)
@steady
def test_a_window_holds_what_is_near_and_in_sight_and_what_is_taken_away_is_gone(known, seed):
    scene = Scene(known, BODY, seed)
    for visible in (False, True):
        sums, window = Sums.none(known.shape), scene.window._replace(visible=visible)
        place = scene.row, scene.col, scene.heading
        view = View(known, interpolation.divisors(window), np.ones(known.shape, bool), visible)
        interpolation.spread(sums, view, *place, 0.7)
        for row, col in np.ndindex(known.shape):
            d = math.hypot(row - scene.row, col - scene.col)
            reached = 0.0 < d <= window.radius and not (
                visible and not interpolation.sees(known, scene.row, scene.col, row, col))
            weight = 0.7 / d ** 2 if reached else 0.0
            assert sums.weight[row, col] == pytest.approx(weight)
            assert (sums.x[row, col], sums.y[row, col]) == pytest.approx(
                tuple(weight * UNIT[scene.heading]))
        interpolation.spread(sums, view, *place, -0.7)
        assert not any(part.any() for part in sums)


@pytest.mark.parametrize(
    ('heading', 'expected'), [(0, 0), (2, 2), (1, 0), (7, 0), (3, 2), (-1, 0)])
def test_of_two_ways_of_one_length_the_one_nearer_to_the_heading_is_taken(heading, expected):
    known = np.full((3, 3), 0, np.int8)
    known[2, 2] = 100  # the goal lies behind it, as far one way as the other
    known[1, 1] = 100
    cost = np.full((3, 3), 5.0)
    cost[0, 1] = cost[1, 0] = 1.0
    assert kernels.best_step(plain_ground(known, BODY), cost, 0, 0, heading) == expected


def loops_from(cell, known, headings, rule):
    """Return whether following the headings from a cell leads back to it."""
    at = cell
    for _ in range(known.size):
        heading = int(headings[at])
        if heading < 0 or not kernels.step_allowed(known, *at, heading, rule):
            return False
        at = at[0] + int(STEP_ROW[heading]), at[1] + int(STEP_COL[heading])
        if at == cell:
            return True
    return False


@given(knowns, rules, seeds)
@steady
def test_what_is_mended_is_an_occupied_course_or_a_cell_of_a_loop(known, rule, seed):
    scene = Scene(known, rule, seed)
    headings, state = scene.headings, scene.state
    mended = repair.mending_cells(scene.ground, scene.cost, headings, state, scene.fixed)
    chosen = [tuple(cell) for cell in np.argwhere(mended).tolist()]
    failing = [cell for cell in np.ndindex(known.shape)
               if state[cell] >= 2 and np.isfinite(scene.cost[cell])]
    stuck = [cell for cell in failing if headings[cell] < 0 or not kernels.step_allowed(
        known, *cell, headings[cell], rule)]
    assert set(chosen) <= set(failing)
    for cell in chosen:
        assert cell in stuck or loops_from(cell, known, headings, rule)
    for cell in stuck:
        beside = [c for c in chosen if c != cell and max(
            abs(cell[0] - c[0]), abs(cell[1] - c[1])) == 1]
        assert cell in chosen or beside
        assert cell not in chosen or not set(beside) & set(stuck)
    for cell in failing:
        if state[cell] == 2 and loops_from(cell, known, headings, rule):
            assert sum(c in chosen for c in loop_of(cell, headings)) == 1


def loop_of(cell, headings):
    loop = [cell]
    while True:
        heading = int(headings[loop[-1]])
        after = loop[-1][0] + int(STEP_ROW[heading]), loop[-1][1] + int(STEP_COL[heading])
        if after == cell:
            return loop
        loop.append(after)
