from hypothesis import given
import numpy as np
import pytest

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels import compiled
from control_field.kernels.steps import is_occupied, step_allowed
from strategies import knowns, rules, seeds, steady


def scene_of(known, seed):
    """Return random headings, mostly sensible, and a goal that is free."""
    rng = np.random.default_rng(seed)
    goal = int(rng.integers(known.shape[0])), int(rng.integers(known.shape[1]))
    known[goal] = 0
    rows, cols = np.indices(known.shape)
    ahead = np.arctan2(goal[0] - rows, goal[1] - cols)
    towards = np.floor(ahead / (np.pi / 4) + 0.5).astype(int) % 8
    wild = rng.integers(-1, 8, known.shape)
    return np.where(rng.random(known.shape) < 0.8, towards, wild).astype(np.int8), goal


def follow(known, headings, cell, goal, rule):
    """Follow the field naively; return the cells, and how it ended: home, loop or occupied."""
    path = [cell]
    while True:
        row, col = path[-1]
        heading = int(headings[row, col])
        if (row, col) == goal:
            return path, 'home'
        if heading < 0 or not step_allowed(known, row, col, heading, rule):
            return path, 'barred'
        step = row + int(STEP_ROW[heading]), col + int(STEP_COL[heading])
        if step in path:
            return [*path, step], 'loop'
        path.append(step)


def flows(known, headings, goal, rule):
    return {cell: follow(known, headings, cell, goal, rule) for cell in np.ndindex(known.shape)
            if not is_occupied(known, *cell, rule[1])}


CODES = {'home': 1, 'loop': 2, 'barred': 3}


@given(knowns, rules, seeds)
@steady
def test_the_basin_is_where_following_leads_home(known, rule, seed):
    headings, goal = scene_of(known, seed)
    state = compiled.flow_basin(known, headings, *goal, rule)
    naive = flows(known, headings, goal, rule)
    for cell in np.ndindex(known.shape):
        assert state[cell] == (CODES[naive[cell][1]] if cell in naive else 0)
        if cell in naive:
            reaches = compiled.flow_reaches(known, headings, *cell, *goal, rule)
            path, end = naive[cell]
            assert reaches == (len(path) - 1 if end == 'home' else -1)


@given(knowns, rules, seeds)
@steady
def test_lengths_are_the_sums_of_the_steps(known, rule, seed):
    headings, goal = scene_of(known, seed)
    length = compiled.flow_lengths(known, headings, *goal, rule)
    naive = flows(known, headings, goal, rule)
    for cell in np.ndindex(known.shape):
        expected = np.inf
        if cell in naive and naive[cell][1] == 'home':
            expected = sum(STEP_LENGTH[headings[at]] for at in naive[cell][0][:-1])
        assert length[cell] == pytest.approx(expected, abs=1e-9)


@given(knowns, rules, seeds)
@steady
def test_every_lost_flow_has_one_end_and_every_end_is_one(known, rule, seed):
    headings, goal = scene_of(known, seed)
    state = compiled.flow_basin(known, headings, *goal, rule)
    starts = np.random.default_rng(seed).random(known.shape) < 0.3
    ends = compiled.flow_ends(known, headings, state, starts, rule)
    loops, occupied = set(), set()
    for cell, (path, end) in flows(known, headings, goal, rule).items():
        if starts[cell] and end == 'barred':
            occupied.add(path[-1])
        if starts[cell] and end == 'loop':
            loops.add(frozenset(path[path.index(path[-1]):]))
    assert all(ends[cell] for cell in occupied)
    for loop in loops:
        assert sum(ends[cell] for cell in loop) == 1
    assert ends.sum() == len(loops) + len(occupied)


@given(knowns, rules, seeds)
@steady
def test_crossings_are_counted(known, rule, seed):
    headings, goal = scene_of(known, seed)
    state = compiled.flow_basin(known, headings, *goal, rule)
    expected = np.zeros(known.shape)
    for path, end in flows(known, headings, goal, rule).values():
        if end == 'home':
            for cell in path:
                expected[cell] += 1
    assert np.array_equal(compiled.n_crossing(headings, state, *goal), expected)


@given(knowns, rules, seeds)
@steady
def test_what_is_seen_along_the_way_is_counted_once(known, rule, seed):
    headings, goal = scene_of(known, seed)
    value = np.random.default_rng(seed).integers(0, 9, known.shape).astype(float)
    state = compiled.flow_basin(known, headings, *goal, rule)
    total = compiled.seen_along(headings, state == 1, value, *goal)
    for cell, (path, end) in flows(known, headings, goal, rule).items():
        seen = np.zeros(known.shape, bool)
        for row, col in path if end == 'home' else []:
            seen[max(row - 1, 0):row + 2, max(col - 1, 0):col + 2] = True
        assert total[cell] == value[seen].sum()
