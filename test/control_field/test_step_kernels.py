import math

from hypothesis import given
from hypothesis import strategies as st
import networkx as nx
import numpy as np
import pytest

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW, UNIT
from control_field.kernels import (
    compiled, decision, interpolation, judging, last_resort, local_search, moving_world, queues,
    rehearsal, repair, rollout, seen, sharing)
from control_field.kernels import steps as kernels
from control_field.kernels import trials, visibility, waiting
from control_field.kernels.interpolation import Sums
from control_field.kernels.steps import no_preference, StepRules
from control_field.learning.interpolation import interpolate
from kernel_scenes import Scene
from strategies import few, knowns, rules, seeds, steady

BODY = StepRules(False, False, 8)
MODULES = (
    kernels, queues, rehearsal, seen, visibility, rollout, local_search, last_resort, decision,
    trials, sharing, judging, waiting, moving_world, interpolation, repair)


def same(first, second):
    """Return whether two values are the same to the bit, arrays and generators included."""
    if isinstance(first, (tuple, list)):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and first.tobytes() == second.tobytes()
    if isinstance(first, np.random.Generator):
        return first.bit_generator.state == second.bit_generator.state
    if isinstance(first, float) and math.isnan(first):
        return math.isnan(second)
    return first == second


@pytest.mark.parametrize('name', sorted(compiled._ALL))
@given(knowns, rules, seeds)
@steady
def test_compiled_and_plain_python_agree_to_the_bit(name, known, rule, seed):
    scene = Scene(known, rule, seed)
    plain = next(vars(module)[name] for module in MODULES if name in vars(module))
    slow, fast = scene.arguments(name), scene.arguments(name)
    assert same(plain(*slow), getattr(compiled, name)(*fast))
    assert same(slow, fast)


def test_no_other_kernel_is_there():
    with pytest.raises(AttributeError, match='no kernel is called plan'):
        compiled.plan  # noqa: B018


def graph_of(known, rule, factor, preference):
    """Return the steps the map allows as a graph, each with its cost."""
    graph = nx.DiGraph()
    graph.add_nodes_from(np.ndindex(known.shape))
    for row, col in np.ndindex(known.shape):
        if kernels.is_occupied(known, row, col, rule[1]):
            continue
        for heading in range(8):
            if naively_allowed(known, row, col, heading, rule):
                to = row + int(STEP_ROW[heading]), col + int(STEP_COL[heading])
                cost = STEP_LENGTH[heading] * factor[to]
                if preference.headings[row, col] == heading:
                    cost *= 1.0 - preference.spared[row, col]
                graph.add_edge((row, col), to, cost=cost, heading=heading)
    return graph


def naively_allowed(known, row, col, heading, rule):
    """Return whether a step is allowed, straight from the words."""
    cutting, keep_out, moves = rule
    if moves == 4 and heading % 2:
        return False
    must_be_free = [heading]
    if heading % 2 and not cutting:
        must_be_free += [heading - 1, (heading + 1) % 8]
    for h in must_be_free:
        r, c = row + int(STEP_ROW[h]), col + int(STEP_COL[h])
        if not (0 <= r < known.shape[0] and 0 <= c < known.shape[1]):
            return False
        if known[r, c] == 100 or (keep_out and known[r, c] == -1):
            return False
        if h != heading and known[r, c] > 0:
            return False  # no diagonal step passes beside what is doubted
    return True


@given(knowns, rules)
@steady
def test_steps_are_allowed_as_the_words_say(known, rule):
    for row, col in np.ndindex(known.shape):
        expected = sum(naively_allowed(known, row, col, h, rule) << h for h in range(8))
        assert compiled.allowed_steps(known, row, col, rule) == expected
        if rule[2] == 4:
            assert expected & 0b10101010 == 0


@given(knowns, rules, seeds)
@steady
def test_the_cost_to_go_is_dijkstras(known, rule, seed):
    scene = Scene(known, rule, seed)
    graph = graph_of(known, rule, scene.ground.factor, scene.preference)
    expected = np.full(known.shape, np.inf)
    for cell, cost in nx.single_source_dijkstra_path_length(
            graph.reverse(), scene.goal, weight='cost').items():
        expected[cell] = cost
    assert np.allclose(scene.cost, expected, atol=1e-9)


def swept(known, goal, factor, preference, discount, rule):
    """
    Run eq. 6 over every transition until nothing changes, learning rate 1.

    R is 1 for the step into the goal, whose own value then stands for R_goal; a step of length l
    discounts by ``discount ** l``.
    """
    q = np.zeros((*known.shape, 8))
    graph = graph_of(known, rule, factor, preference)
    while True:
        before = q.copy()
        for cell, to, edge in graph.edges(data=True):
            ahead = 1.0 if to == goal else q[to].max()
            target = discount ** edge['cost'] * ahead
            q[(*cell, edge['heading'])] += 1.0 * (target - q[(*cell, edge['heading'])])
        if np.array_equal(q, before):
            return q


@given(knowns, rules, seeds)
@few
def test_the_cost_to_go_is_the_fixed_point_of_equation_6(known, rule, seed):
    scene = Scene(known, rule, seed)
    known[scene.goal] = 0
    cost = compiled.cost_to_go(scene.ground, scene.goal, scene.preference)
    q = compiled.q_from_cost(scene.ground, cost, scene.preference, 0.9)
    expected = swept(known, scene.goal, scene.ground.factor, scene.preference, 0.9, rule)
    assert np.allclose(np.maximum(q, 0.0), expected, atol=1e-12)
    for row, col in np.argwhere(known == 0).tolist():
        occupied = [not naively_allowed(known, row, col, h, rule) for h in range(8)]
        assert (q[row, col] == -1.0).tolist() == occupied


def test_a_way_however_long_keeps_a_value_that_float32_can_hold():
    known = np.zeros((1, 400), np.int8)
    ground, none = kernels.plain_ground(known, BODY), no_preference(known.shape)
    cost = compiled.cost_to_go(ground, (0, 0), none)
    q = compiled.q_from_cost(ground, cost, none, 0.5)
    assert (q.astype(np.float32)[0, 1:, 4] > 0.0).all()


@given(knowns, rules, seeds)
@steady
def test_rehearsal_around_the_robot_with_enough_backups_is_the_whole_recomputation(
        known, rule, seed):
    scene = Scene(known, rule, seed)
    whole = compiled.cost_to_go(scene.ground, scene.goal, no_preference(known.shape))
    stale = np.where(np.random.default_rng(seed).random(known.shape) < 0.5, np.inf, 3.0)
    stale[scene.goal] = 0.0
    compiled.rehearse_locally(
        scene.ground, stale, scene.search(), scene.row, scene.col, scene.goal, 10_000)
    best = compiled.best_step(scene.ground, stale, scene.row, scene.col, -1)
    if kernels.is_occupied(known, scene.row, scene.col, rule[1]):
        return
    here = scene.row, scene.col
    assert stale[here] == pytest.approx(whole[here], abs=1e-9)
    if here == scene.goal or not np.isfinite(whole[here]):
        assert best == -1 or here == scene.goal
        return
    r, c = here[0] + STEP_ROW[best], here[1] + STEP_COL[best]
    assert whole[here] == pytest.approx(
        whole[r, c] + STEP_LENGTH[best] * scene.ground.factor[r, c], abs=1e-9)


@given(knowns, rules, seeds, st.integers(0, 30))
@steady
def test_rehearsal_looks_at_no_more_cells_than_it_may(known, rule, seed, n_backups):
    scene = Scene(known, rule, seed)
    search, n_cols = scene.search(), known.shape[1]
    here, goal = (row * n_cols + col for row, col in ((scene.row, scene.col), scene.goal))
    compiled.look_around(scene.ground, search, here, goal, n_backups)
    looked = {divmod(place, n_cols) for place in np.flatnonzero(
        search.noted >= local_search.LOOKED_AT).tolist()}
    assert len(looked) <= n_backups
    before = scene.cost.copy()
    compiled.rehearse_locally(scene.ground, scene.cost, scene.search(), scene.row, scene.col,
                              scene.goal, n_backups)
    for cell in np.ndindex(known.shape):
        assert scene.cost[cell] == before[cell] or cell in looked


@given(knowns, rules, seeds)
@steady
def test_the_windows_of_equation_7_sum_up_what_interpolation_averages(known, rule, seed):
    scene = Scene(known, rule, seed)
    sums, centres = Sums.none(known.shape), scene.centres
    window = scene.window._replace(visible=False)
    compiled.add_windows(sums, known, centres, window, np.ones(known.shape, bool))
    free_of_centres = scene.centre < 0
    points = np.argwhere(free_of_centres & (sums.weight > 0.0)).astype(float)
    if len(points):
        expected = interpolate(points, centres.cells.astype(float), UNIT[centres.headings],
                               centres.weights, 2.0, window.radius)
        at = tuple(points.astype(int).T)
        assert np.allclose(sums.x[at] / sums.weight[at], expected[:, 0], atol=1e-12)
        assert np.allclose(sums.y[at] / sums.weight[at], expected[:, 1], atol=1e-12)


def test_a_window_does_not_reach_through_any_cell_the_line_crosses():
    for wall, visible in (((0, 1), False), ((1, 1), False), ((1, 0), True), ((0, 2), True)):
        known = np.full((2, 3), -1, np.int8)
        known[wall] = 100
        assert sees(known, (0, 0), (1, 2)) == sees(known, (1, 2), (0, 0)) == visible
    assert sees(np.zeros((1, 9), np.int8), (0, 0), (0, 8))
    assert sees(np.full((2, 2), 100, np.int8), (0, 0), (1, 1)) is False


def sees(known, here, there):
    return interpolation.sees(known, *here, *there)


@pytest.mark.parametrize(('fixed', 'known', 'expected'), [
    ([], 100, (0, 0)), ([(0, 0)], 100, (0, 1)), ([(0, 0), (0, 1)], 100, (1, 0)),
    ([(0, 0), (0, 1), (1, 0), (1, 1)], 100, (0, 0)),
    # On free ground (0, 0) goes the best way already.
    ([], 0, (0, 1)), ([(0, 1), (1, 0), (1, 1)], 0, (0, 1))])
def test_a_loop_is_mended_where_nothing_was_shown_if_it_can_be(fixed, known, expected):
    loop = np.array([[0, 2], [6, 4]], np.int8)
    shown = np.zeros((2, 2), bool)
    for cell in fixed:
        shown[cell] = True
    ground = kernels.plain_ground(np.full((2, 2), known, np.int8), BODY)
    assert repair.cheapest_of_loop(
        ground, np.arange(4.0).reshape(2, 2), loop, shown, 1, 1) == expected
