import numpy as np
import pytest

from control_field.grid import Grid
from control_field.records import (
    ControlField, DECISION_DTYPE, Demonstration, Kind, Outcome, Prototypes, Trial)
from strategies import demonstration_of


def arrays(n):
    return np.zeros(n), np.zeros(n, np.uint8), np.zeros(n, np.uint8)


def field(**changes):
    values = {
        'grid': Grid(2, 3, 1.0), 'revision': 1, 'goal': (1, 2), 'vx': np.zeros((2, 3), np.float32),
        'vy': np.zeros((2, 3), np.float32), 'coherence': np.zeros((2, 3), np.float32),
        'q': np.zeros((2, 3, 8), np.float32), 'known': np.zeros((2, 3), np.int8),
        'flags': np.zeros((2, 3), np.uint8)}
    return ControlField(**{**values, **changes})


def test_a_demonstration_steps_from_neighbour_to_neighbour():
    demonstration = demonstration_of([(0, 0), (1, 1), (1, 2), (0, 2)])
    assert len(demonstration.cells) == 4
    assert len(demonstration_of([]).cells) == 0
    assert len(demonstration_of([(3, 3)]).cells) == 1


@pytest.mark.parametrize(('cells', 'why'), [
    ([(0, 0), (0, 0)], 'stays in one cell'),
    ([(0, 0), (0, 1), (0, 1), (0, 2)], 'stays in one cell'),
    ([(0, 0), (0, 2)], 'jumps'),
    ([(0, 0), (1, 1), (3, 1)], 'jumps'),
    ([(0, 0), (-2, 0)], 'jumps'),
])
def test_a_demonstration_that_stays_or_jumps_is_refused(cells, why):
    with pytest.raises(ValueError, match=why):
        demonstration_of(cells)


def test_shapes_that_disagree_are_refused_by_name():
    cells = np.array([[0, 0], [0, 1]], np.int32)
    stamps, blocked, unknown = arrays(2)
    with pytest.raises(ValueError, match=r'stamps has shape \(3,\), must be \(2,\)'):
        Demonstration(cells, np.zeros(3), blocked, unknown)
    with pytest.raises(ValueError, match='unknown'):
        Demonstration(cells, stamps, blocked, np.zeros(1, np.uint8))
    with pytest.raises(ValueError, match='cells'):
        Demonstration(np.zeros((2, 3), np.int32), stamps, blocked, unknown)
    with pytest.raises(ValueError, match=r'cells has shape \(2, 3\), must be \(2, 2\)'):
        Prototypes(np.zeros((2, 3), np.int32), *([np.zeros(2)] * 5))
    with pytest.raises(ValueError, match='headings'):
        Prototypes(cells, np.zeros(1, np.int8), *([np.zeros(2)] * 4))
    with pytest.raises(ValueError, match=r'q has shape \(2, 3, 4\), must be \(2, 3, 8\)'):
        field(q=np.zeros((2, 3, 4), np.float32))
    with pytest.raises(ValueError, match='vx'):
        field(vx=np.zeros((3, 2), np.float32))


def test_a_goal_outside_is_refused():
    with pytest.raises(ValueError, match=r'goal \(2, 0\) lies outside'):
        field(goal=(2, 0))


def test_a_void_field_says_nothing_anywhere_and_another_does():
    void = ControlField.void(Grid(2, 3, 1.0))
    assert void.is_void
    assert (void.revision, void.goal) == (0, (0, 0))
    assert (void.known == -1).all()
    for name in ('vx', 'vy', 'coherence', 'q', 'flags'):
        assert not getattr(void, name).any()
    one = np.zeros((2, 3), np.float32)
    one[1, 1] = -1.0
    assert not field(vx=one).is_void
    assert not field(vy=one).is_void


def test_records_cannot_be_changed():
    for array in (field().q, demonstration_of([(0, 0), (0, 1)]).cells,
                  Trial(np.zeros(1, DECISION_DTYPE), Outcome.GOAL).decisions):
        with pytest.raises(ValueError, match='read-only'):
            array[0] = 0


def test_a_trial_counts_steps_and_reinforcements():
    rows = np.zeros(4, DECISION_DTYPE)
    rows['kind'] = [Kind.FIELD, Kind.BLOCKED, Kind.AVOID, Kind.FIELD]
    rows['reward'] = [0, -1, 1, 0]
    trial = Trial(rows, Outcome.GOAL, 7)
    assert (trial.n_steps, trial.n_online_reinforcements, trial.episode) == (3, 2, 7)


@pytest.mark.parametrize('table', [np.zeros(3), np.zeros((2, 2), DECISION_DTYPE)])
def test_a_trial_is_a_table_of_decisions(table):
    with pytest.raises(ValueError, match='DECISION_DTYPE'):
        Trial(table, Outcome.GOAL)


def test_what_goes_over_the_wire_has_fixed_numbers():
    assert [kind.value for kind in Kind] == [0, 1, 2, 3, 4, 5]
    assert DECISION_DTYPE.itemsize == 8 + 3 * 4 + 4 * 4 + 5
