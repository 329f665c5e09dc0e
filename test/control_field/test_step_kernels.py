import math

from hypothesis import given
from hypothesis import strategies as st
import networkx as nx
import numpy as np
import pytest

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW, UNIT
from control_field.kernels import compiled
from control_field.kernels import decision as trial_kernels
from control_field.kernels import interpolation as field_kernels
from control_field.kernels import local_search as rehearsal_kernels
from control_field.kernels import repair as mending_kernels
from control_field.kernels import rollout as flow_kernels
from control_field.kernels import steps as kernels
from control_field.learning.interpolation import interpolate
from kernel_scenes import Scene
from strategies import few, knowns, rules, seeds, steady

BODY = (False, False, 8)


#: Rehearsal stands in two of them; the robot's own comes first.
MODULES = (kernels, flow_kernels, trial_kernels, field_kernels, mending_kernels, rehearsal_kernels)
#: Not worth its time to compile: the learner's side has `look_around` in its stead.
ROBOTS_OWN = {'look_ahead'}


def same(first, second):
    """Tell whether two values are the same to the bit, arrays and generators included."""
    if isinstance(first, (tuple, list)):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and first.tobytes() == second.tobytes()
    if isinstance(first, np.random.Generator):
        return first.bit_generator.state == second.bit_generator.state
    if isinstance(first, float) and math.isnan(first):
        return math.isnan(second)
    if hasattr(first, 'items'):
        return dict(first) == dict(second)
    return first == second


@pytest.mark.parametrize('name', sorted(set(compiled._ALL) - ROBOTS_OWN))
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


def graph_of(known, rule, factor, preferred=None, spared=None):
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
                if preferred is not None and preferred[row, col] == heading:
                    cost *= 1.0 - spared[row, col]
                graph.add_edge((row, col), to, cost=cost, heading=heading)
    return graph


def naively_allowed(known, row, col, heading, rule):
    """Tell whether a step is allowed, straight from the words."""
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
    graph = graph_of(known, rule, scene.factor, scene.headings, scene.spared)
    expected = np.full(known.shape, np.inf)
    for cell, cost in nx.single_source_dijkstra_path_length(
            graph.reverse(), scene.goal, weight='cost').items():
        expected[cell] = cost
    assert np.allclose(scene.cost, expected, atol=1e-9)


def swept(known, goal, factor, preferred, spared, discount, rule):
    """
    Run eq. 6 over every transition until nothing changes, learning rate 1.

    R is 1 for the step into the goal, whose own value then stands for R_goal; a step of length l
    discounts by ``discount ** l``.
    """
    q = np.zeros((*known.shape, 8))
    graph = graph_of(known, rule, factor, preferred, spared)
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
    cost = compiled.cost_to_go(
        known, *scene.goal, scene.headings, scene.spared, scene.factor, rule)
    q = compiled.q_from_cost(
        known, cost, scene.headings, scene.spared, scene.factor, 0.9, rule)
    expected = swept(
        known, scene.goal, scene.factor, scene.headings, scene.spared, 0.9, rule)
    assert np.allclose(np.maximum(q, 0.0), expected, atol=1e-12)
    for row, col in np.argwhere(known == 0).tolist():
        occupied = [not naively_allowed(known, row, col, h, rule) for h in range(8)]
        assert (q[row, col] == -1.0).tolist() == occupied


def test_a_way_however_long_keeps_a_value_that_float32_can_hold():
    known = np.zeros((1, 400), np.int8)
    none, nothing, factor = np.full((1, 400), -1, np.int8), np.zeros((1, 400)), np.ones((1, 400))
    cost = compiled.cost_to_go(known, 0, 0, none, nothing, factor, BODY)
    q = compiled.q_from_cost(known, cost, none, nothing, factor, 0.5, BODY)
    assert (q.astype(np.float32)[0, 1:, 4] > 0.0).all()


@given(knowns, rules, seeds)
@steady
def test_rehearsal_around_the_robot_with_enough_backups_is_the_whole_recomputation(
        known, rule, seed):
    scene = Scene(known, rule, seed)
    none, nothing = np.full(known.shape, -1, np.int8), np.zeros(known.shape)
    whole = compiled.cost_to_go(known, *scene.goal, none, nothing, scene.factor, rule)
    stale = np.where(np.random.default_rng(seed).random(known.shape) < 0.5, np.inf, 3.0)
    stale[scene.goal] = 0.0
    compiled.rehearse_locally(
        known, stale, scene.factor, scene.row, scene.col, *scene.goal, 10_000, rule)
    course = compiled.best_step(
        known, stale, scene.factor, scene.row, scene.col, -1, rule)
    if kernels.is_occupied(known, scene.row, scene.col, rule[1]):
        return
    here = scene.row, scene.col
    assert stale[here] == pytest.approx(whole[here], abs=1e-9)
    if here == scene.goal or not np.isfinite(whole[here]):
        assert course == -1 or here == scene.goal
        return
    r, c = here[0] + STEP_ROW[course], here[1] + STEP_COL[course]
    assert whole[here] == pytest.approx(
        whole[r, c] + STEP_LENGTH[course] * scene.factor[r, c], abs=1e-9)


@given(knowns, rules, seeds, st.integers(0, 30))
@steady
def test_rehearsal_looks_at_no_more_cells_than_it_may(known, rule, seed, n_backups):
    scene = Scene(known, rule, seed)
    looked = kernels.look_ahead(
        known, scene.factor, scene.row, scene.col, *scene.goal, n_backups, rule)
    assert sum(looked.values()) <= n_backups
    before = scene.cost.copy()
    compiled.rehearse_locally(
        known, scene.cost, scene.factor, scene.row, scene.col, *scene.goal, n_backups, rule)
    for cell in np.ndindex(known.shape):
        assert scene.cost[cell] == before[cell] or looked.get(cell, False)


@given(knowns, rules, seeds)
@steady
def test_the_windows_of_equation_7_sum_up_what_interpolation_averages(known, rule, seed):
    scene = Scene(known, rule, seed)
    totals = tuple(np.zeros(known.shape) for _ in range(3))
    compiled.add_windows(*totals, known, scene.cells, scene.proto, scene.weights, scene.window,
                         2.0, False)
    free_of_centres = scene.centre < 0
    points = np.argwhere(free_of_centres & (totals[2] > 0.0)).astype(float)
    if len(points):
        expected = interpolate(points, scene.cells.astype(float), UNIT[scene.proto],
                               scene.weights, 2.0, scene.window)
        at = tuple(points.astype(int).T)
        assert np.allclose(totals[0][at] / totals[2][at], expected[:, 0], atol=1e-12)
        assert np.allclose(totals[1][at] / totals[2][at], expected[:, 1], atol=1e-12)


def test_a_window_does_not_reach_through_any_cell_the_line_crosses():
    for wall, seen in (((0, 1), False), ((1, 1), False), ((1, 0), True), ((0, 2), True)):
        known = np.full((2, 3), -1, np.int8)
        known[wall] = 100
        assert sees(known, (0, 0), (1, 2)) == sees(known, (1, 2), (0, 0)) == seen
    assert sees(np.zeros((1, 9), np.int8), (0, 0), (0, 8))
    assert sees(np.full((2, 2), 100, np.int8), (0, 0), (1, 1)) is False


def sees(known, here, there):
    return field_kernels.sees(known, *here, *there)


@pytest.mark.parametrize(('fixed', 'known', 'expected'), [
    ([], 100, (0, 0)), ([(0, 0)], 100, (0, 1)), ([(0, 0), (0, 1)], 100, (1, 0)),
    ([(0, 0), (0, 1), (1, 0), (1, 1)], 100, (0, 0)),
    # On free ground (0, 0) goes the best way already.
    ([], 0, (0, 1)), ([(0, 1), (1, 0), (1, 1)], 0, (0, 1))])
def test_a_loop_is_mended_where_nothing_was_shown_if_it_can_be(fixed, known, expected):
    loop = np.array([[0, 2], [6, 4]], np.int8)
    cost, chosen = np.arange(4.0).reshape(2, 2), np.zeros((2, 2), bool)
    shown = np.zeros((2, 2), bool)
    for cell in fixed:
        shown[cell] = True
    mending_kernels.mend_loop(
        np.full((2, 2), known, np.int8), cost, np.ones((2, 2)), loop, shown,
        np.zeros((2, 2), np.int64), chosen, 1, 1, 1, (False, False, 8))
    assert list(map(tuple, np.argwhere(chosen).tolist())) == [expected]
