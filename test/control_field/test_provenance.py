"""Every heading of every field is made up of the voices that are shown."""

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.headings import UNIT
from control_field.learning.interpolation import weight_from_q
from control_field.learning.provenance import TOLERANCE, vector_at, voices_at
from strategies import few, practise, relearner, seeds, segment, taught


def check_everywhere(refresh, parameters, known=None):
    """Take the heading of every cell apart, and see that it adds up."""
    field, prototypes = refresh.field, refresh.prototypes
    for row, col in np.ndindex(*field.grid.shape):
        voices = voices_at(field, prototypes, parameters, row, col, known)
        assert voices is not None, (row, col)
        assert math.dist(voices.vector, vector_at(field, row, col)) <= TOLERANCE
        total = voices.shares @ UNIT[prototypes.headings[voices.indices]]
        if voices.attraction >= 0:
            total = total + voices.attraction_share * UNIT[voices.attraction]
        np.testing.assert_allclose(total, voices.vector, atol=1e-12)
        assert (voices.weights > 0).all()
        assert list(voices.weights) == sorted(voices.weights, reverse=True)
        if len(voices.weights) or voices.attraction >= 0:
            assert voices.shares.sum() + voices.attraction_share == pytest.approx(1.0)


@few
@given(relearner(), st.sampled_from(['paper', 'full']), seeds)
def test_the_shares_make_up_the_vector_everywhere(learnt_bag, profile, seed):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, profile=profile)
    check_everywhere(learner.refresh, learner.parameters)
    free = np.argwhere(occupancy == 0)
    for start in np.random.default_rng(seed).permutation(free)[:3]:
        planned = learner.refresh.composition.planned
        practise(learner, occupancy, [start])
        if learner.refresh.pushed:
            planned = learner.refresh.composition.planned
        # A refresh that was not pushed keeps the headings, which were made on the map of before.
        check_everywhere(learner.refresh, learner.parameters, planned)
        if not learner.refresh.pushed:
            return


@pytest.mark.parametrize('values', [
    {'pull': False}, {'visible_windows': False}, {'rehearsal': False}, {'pruning': False},
    {'effective_window': 2.0}, {'power': 4.0}, {'moves': 4},
    {'profile': 'paper', 'effective_window': 2.0}])
def test_they_do_with_every_part_switched_off(values):
    occupancy = np.zeros((9, 9), np.int8)
    occupancy[3:6, 4] = 100
    learner = taught(segment((1, 1), (1, 7), (7, 7)), occupancy.shape, occupancy, **values)
    check_everywhere(learner.refresh, learner.parameters)
    practise(learner, occupancy, [(4, 1)])
    if learner.refresh.pushed:
        check_everywhere(learner.refresh, learner.parameters)


def test_on_a_centre_its_prototype_is_the_only_voice():
    learner = taught(segment((1, 1), (1, 5)), (6, 7))
    voices = voices_at(learner.refresh.field, learner.refresh.prototypes, learner.parameters, 1, 2)
    assert learner.refresh.prototypes.cells[voices.indices].tolist() == [[1, 2]]
    assert (voices.shares.tolist(), voices.distances.tolist()) == ([1.0], [0.0])
    assert voices.attraction == -1


def test_prototypes_of_another_field_are_found_out():
    ours, others = taught(segment((1, 1), (1, 5)), (6, 7)), taught(segment((4, 5), (4, 1)), (6, 7))
    assert voices_at(ours.refresh.field, others.refresh.prototypes, ours.parameters, 2, 2) is None
    assert voices_at(ours.refresh.field, others.refresh.prototypes, ours.parameters, 4, 4) is None


def test_headings_around_what_is_doubted_are_taken_apart_too():
    world = np.zeros((7, 9), np.int8)
    learner = taught(segment((3, 0), (3, 8)), world.shape, world)
    practise(learner, world, [(3, 0)])
    world[2:5, 4] = 100
    practise(learner, world, [(3, 0)], 3)
    for made in (learner.refresh.composition, learner.shown):
        for row, col in np.argwhere(made.planned == 0).tolist():
            assert voices_at(made.field, made.prototypes, learner.parameters, row, col,
                             made.planned) is not None


def test_so_are_those_around_a_shown_way_that_a_shorter_one_outdoes():
    world = np.zeros((9, 11), np.int8)
    world[4, :10] = 100
    learner = taught(segment((2, 1), (2, 10), (6, 10), (6, 1)), world.shape, world)
    practise(learner, world, [(2, 1), (3, 5)], 4)
    world[4, 1] = 0
    practise(learner, world, [(3, 1), (5, 2)], 4)
    made, parameters = learner.refresh.composition, learner.parameters
    usual = weight_from_q(made.prototypes.q, parameters.weight_floor)
    assert (made.weights < usual).any()  # the shown way draws less than its Q-values say
    for row, col in np.argwhere(made.planned == 0).tolist():
        assert voices_at(made.field, made.prototypes, parameters, row, col, made.planned,
                         made.weights) is not None
    assert any(voices_at(made.field, made.prototypes, parameters, row, col, made.planned) is None
               for row, col in np.argwhere(made.planned == 0).tolist())
