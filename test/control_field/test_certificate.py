from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW, UNIT
from control_field.kernels import compiled
from control_field.kernels.interpolation import Sums
from control_field.kernels.steps import (
    is_occupied, no_preference, plain_ground, step_allowed, StepRules)
from control_field.learning.certificate import certify, fidelity_of
from control_field.records import ControlField
from strategies import knowns, rules, seeds, steady

BODY = StepRules(False, False, 8)


def field_of(known, headings, goal, coherence=None):
    vx, vy = (np.where(headings >= 0, UNIT[headings, axis], 0.0).astype(np.float32)
              for axis in (0, 1))
    return ControlField(
        Grid(*known.shape, 1.0), 1, goal, vx, vy,
        np.ones(known.shape, np.float32) if coherence is None else coherence,
        np.zeros((*known.shape, 8), np.float32), known.copy(), np.zeros(known.shape, np.uint8))


def comes_home(known, headings, cell, goal, rule):
    for _ in range(known.size + 1):
        if cell == goal:
            return True
        heading = headings[cell]
        if heading < 0 or not step_allowed(known, *cell, heading, rule):
            return False
        cell = cell[0] + int(STEP_ROW[heading]), cell[1] + int(STEP_COL[heading])
    return False


@given(knowns, rules, seeds, st.data())
@steady
def test_the_certificate_says_what_following_the_field_from_every_cell_shows(
        known, rule, seed, data):
    rng = np.random.default_rng(seed)
    goal = data.draw(st.tuples(*(st.integers(0, n - 1) for n in known.shape)))
    known[goal] = 0
    ground, none = plain_ground(known, rule), no_preference(known.shape)
    cost = compiled.cost_to_go(ground, goal, none)
    sensible = compiled.attraction_from_cost(ground, cost, Sums.none(known.shape))
    wild = rng.integers(-1, 8, known.shape).astype(np.int8)
    headings = np.where(rng.random(known.shape) < 0.8, sensible, wild).astype(np.int8)
    coherence = rng.random(known.shape).astype(np.float32)
    certificate = certify(field_of(known, headings, goal, coherence), none.headings, 7, rule)

    counted = [cell for cell in np.ndindex(known.shape)
               if known[cell] == 0 and np.isfinite(cost[cell])]
    home = [comes_home(known, headings, cell, goal, rule) for cell in counted]
    strict = rule._replace(unknown_is_blocked=True)
    proven = [comes_home(known, headings, cell, goal, strict) for cell in counted]
    assert certificate.n_reachable == len(counted)
    assert certificate.basin == pytest.approx(np.mean(home))
    assert certificate.proven == pytest.approx(np.mean(proven))
    assert certificate.proven <= certificate.basin + 1e-12
    assert certificate.n_free == (known == 0).sum()
    assert certificate.n_prototypes == 7
    assert np.isnan(certificate.fidelity)
    away = [float(coherence[cell]) for cell in counted if cell != goal]
    assert certificate.coherence_min == pytest.approx(min(away, default=0.0))
    sinks = set(map(tuple, certificate.sinks.tolist()))
    assert not any(comes_home(known, headings, cell, goal, rule) for cell in sinks)
    assert bool(sinks) == (certificate.basin < 1.0) or not counted
    occupied = {cell for cell in counted if cell != goal and (
        headings[cell] < 0 or not step_allowed(known, *cell, headings[cell], rule))}
    assert occupied <= sinks


def test_a_flow_that_ends_in_unseen_ground_has_a_sink_there():
    known = np.array([[0, -1, -1, 0]], np.int8)
    headings = np.array([[0, 0, 4, 0]], np.int8)
    certificate = certify(field_of(known, headings, (0, 3)), headings, 3, BODY)
    assert certificate.basin == 0.5
    assert certificate.sinks.tolist() in ([[0, 1]], [[0, 2]])


@given(knowns, rules, seeds)
@steady
def test_fidelity_counts_what_is_still_done_of_what_is_still_possible(known, rule, seed):
    rng = np.random.default_rng(seed)
    demonstrated = rng.integers(-1, 8, known.shape).astype(np.int8)
    others = (demonstrated + 1) % 8
    headings = np.where(rng.random(known.shape) < 0.5, demonstrated, others).astype(np.int8)
    kept = [headings[cell] == demonstrated[cell] for cell in np.ndindex(known.shape)
            if demonstrated[cell] >= 0 and known[cell] != 100
            and step_allowed(known, *cell, demonstrated[cell], rule)]
    fidelity = fidelity_of(headings, demonstrated, known, rule)
    assert np.isnan(fidelity) if not kept else fidelity == pytest.approx(np.mean(kept))


def test_a_perfect_a_useless_and_a_looping_field():
    known = np.zeros((1, 4), np.int8)
    east = np.zeros((1, 4), np.int8)
    perfect = certify(field_of(known, east, (0, 3)), east, 3, BODY)
    assert (perfect.basin, perfect.proven, len(perfect.sinks)) == (1.0, 1.0, 0)
    useless = certify(field_of(known, east + 4, (0, 3)), east, 3, BODY)
    assert useless.basin == 0.25
    assert useless.sinks.tolist() == [[0, 0]]
    assert useless.fidelity == 0.0
    looping = certify(field_of(known, np.array([[0, 4, 0, 0]], np.int8), (0, 3)), east, 3, BODY)
    assert looping.basin == 0.5
    assert len(looping.sinks) == 1


def test_where_nothing_is_known_nothing_is_certified():
    known = np.full((1, 4), -1, np.int8)
    certificate = certify(field_of(known, 0 * known, (0, 3)), -1 - 0 * known, 0, BODY)
    assert (certificate.basin, certificate.proven, certificate.coherence_min) == (0.0, 0.0, 0.0)
    assert (certificate.n_free, certificate.n_reachable, len(certificate.sinks)) == (0, 0, 0)


def test_unseen_ground_counts_for_the_basin_but_not_as_proven():
    known = np.array([[0, -1, 0, 0]], np.int8)
    certificate = certify(field_of(known, 0 * known, (0, 3)), -1 - 0 * known, 3, BODY)
    assert (certificate.basin, certificate.n_reachable) == (1.0, 3)
    assert certificate.proven == pytest.approx(2 / 3)
    assert not is_occupied(known, 0, 1, False)


def test_the_sentence_is_plain_and_the_numbers_hold_the_rest():
    known = np.zeros((1, 4), np.int8)
    certificate = certify(field_of(known, 0 * known, (0, 3)), 0 * known, 3, BODY)
    assert certificate.sentence() == (
        'From all 4 places seen so far the robot gets to the goal.')
    for part in ('basin 100.0% of 4 known free cells', '0 sinks', 'fidelity 100.0%',
                 '3 prototypes'):
        assert part in certificate.numbers()


def test_the_sentence_does_not_round_up_to_all():
    known = np.zeros((1, 4), np.int8)
    field = field_of(known, np.array([[4, 0, 0, 0]], np.int8), (0, 3))
    certificate = certify(field, 0 * known, 3, BODY)
    assert certificate.sentence() == (
        'From 3 of 4 places seen so far the robot gets to the goal.')


def test_the_sentence_says_how_many_known_cells_are_cut_off():
    known = np.array([[0, 0, 100, 0, 0, 0]], np.int8)
    certificate = certify(field_of(known, 0 * known, (0, 5)), -1 - 0 * known, 1, BODY)
    assert (certificate.n_free, certificate.n_reachable) == (5, 3)
    assert certificate.sentence().endswith('There is no way to it from 2 more.')


def test_no_place_with_a_way_to_the_goal_is_said_so():
    known = np.array([[0, 0, 100, 100, 0, -1]], np.int8)
    certificate = certify(field_of(known, 0 * known, (0, 2)), -1 - 0 * known, 1, BODY)
    assert certificate.n_reachable == 0
    assert certificate.sentence() == (
        'From none of the places seen so far there is a way to the goal.')
