from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.headings import headings_from_vectors, UNIT
from control_field.kernels import compiled
from control_field.learning.compose import compose
from control_field.learning.interpolation import interpolate, weight_from_q
from control_field.learning.memory import Memory
from control_field.parameters import Parameters
from control_field.records import CellFlag
from control_field.robot.policy import rules_of
from strategies import few, practise, relearner, segment, steady, taught

#: A wall with a gap, between the way shown and the rest.
WALLED = np.zeros((9, 9), np.int8)
WALLED[4, 1:8] = 100
SHOWN = segment((1, 1), (1, 7), (2, 8))


def headings_of(field):
    return headings_from_vectors(field.vx, field.vy)


@given(relearner(), st.floats(0.5, 6.0), st.floats(1.0, 12.0))
@steady
def test_the_papers_field_is_equation_7_over_what_was_learnt(learnt_bag, power, window):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, profile='paper', power=power,
                     effective_window=window)
    practise(learner, occupancy, [cells[0]] * 2)
    field, prototypes = learner.refresh.field, learner.memory.prototypes()
    every = np.argwhere(np.ones(occupancy.shape, bool)).astype(float)
    vectors = interpolate(every, prototypes.cells.astype(float), UNIT[prototypes.headings],
                          weight_from_q(prototypes.q, learner.parameters.weight_floor), power,
                          window)
    length = np.hypot(*vectors.T)
    assert np.allclose(field.coherence.ravel(), np.minimum(length, 1.0), atol=1e-6)
    clear = length > 1e-3
    assert np.allclose(np.stack([field.vx.ravel(), field.vy.ravel()], axis=1)[clear],
                       vectors[clear] / length[clear, None], atol=1e-4)
    assert np.array_equal(field.q, learner.memory.q.astype(np.float32))


@given(relearner(blind=True), st.sampled_from(['paper', 'full']))
@steady
def test_courses_are_unit_vectors_and_flags_say_what_is_there(learnt_bag, profile):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, profile=profile)
    field, prototypes = learner.refresh.field, learner.refresh.prototypes
    length = np.hypot(field.vx, field.vy)
    assert (np.isclose(length, 1.0, atol=1e-6) | (length == 0.0)).all()
    assert ((field.coherence >= 0.0) & (field.coherence <= 1.0)).all()
    centre = np.zeros(occupancy.shape, bool)
    centre[tuple(prototypes.cells.T)] = True
    assert np.array_equal(field.flags & CellFlag.PROTOTYPE > 0, centre)
    demonstrated = learner.memory.demonstrated >= 0
    assert np.array_equal(field.flags & CellFlag.DEMONSTRATED > 0, demonstrated)
    assert np.argwhere(field.flags & CellFlag.GOAL).tolist() == [list(cells[-1])]
    near = np.hypot(*(np.argwhere(np.ones(occupancy.shape))[:, None] - prototypes.cells).T)
    window = learner.parameters.effective_window
    assert np.array_equal(field.flags & CellFlag.SUPPORTED > 0,
                          (near.min(axis=0) <= window).reshape(occupancy.shape))


@given(relearner(), st.booleans())
@steady
def test_what_was_shown_is_kept_where_it_is_free(learnt_bag, cutting):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, corner_cutting=cutting)
    practise(learner, occupancy, [cells[0]])
    assert learner.refresh.certificate.fidelity == 1.0
    headings = headings_of(learner.refresh.field)
    demonstrated = learner.memory.demonstrated
    assert np.array_equal(headings[demonstrated >= 0], demonstrated[demonstrated >= 0])


@given(relearner(low=4, blind=True), st.data())
@few
def test_from_everywhere_on_the_remembered_map_the_flow_comes_home(learnt_bag, data):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, step_limit=300)
    free = np.argwhere(occupancy == 0).tolist()
    for trial in range(3):
        certificate = learner.refresh.certificate
        assert certificate.basin == 1.0
        assert len(certificate.sinks) == 0
        practise(learner, occupancy, [data.draw(st.sampled_from(free))], seed=trial)
    assert learner.refresh.certificate.basin == 1.0


@given(relearner(low=4, blind=True))
@few
def test_the_robots_headings_are_the_ones_that_were_mended(learnt_bag):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape)
    practise(learner, occupancy, [cells[-1]] if not occupancy[cells[-1]] else [])
    field = learner.refresh.field
    rules = rules_of(learner.parameters)
    state = compiled.flow_basin(field.known, headings_of(field), *field.goal, rules)
    reachable = learner.refresh.composition.reachable & (field.known != 100)
    assert (state[reachable] == 1).all()


@given(relearner(low=4), st.data())
@few
def test_pruning_never_lowers_the_basin_and_never_adds(learnt_bag, data):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy)
    free = np.argwhere(occupancy == 0).tolist()
    practise(learner, occupancy, [data.draw(st.sampled_from(free))])
    memory, rules = learner.memory, rules_of(learner.parameters)
    results = []
    for pruning in (False, True):
        memory.parameters = Parameters(pruning=pruning)
        composition = compose(memory)
        state = compiled.flow_basin(memory.known, headings_of(composition.field), *memory.goal,
                                    rules)
        results.append(((state == 1).sum(), len(composition.prototypes)))
    (plain, n_plain), (pruned, n_pruned) = results
    assert pruned >= plain
    assert n_pruned <= n_plain


@pytest.mark.parametrize('switch', ['pull', 'visible_windows', 'rehearsal', 'repair', 'pruning'])
def test_every_switch_changes_the_field(switch):
    fields = []
    for on in (True, False):
        learner = taught(SHOWN, WALLED.shape, WALLED, **{switch: on})
        practise(learner, WALLED, [(8, 0), (8, 8), (6, 4), (3, 0)])
        fields.append(learner.refresh)
    first, second = (refresh.field.vx.tobytes() + refresh.field.vy.tobytes()
                     + refresh.prototypes.cells.tobytes() for refresh in fields)
    assert first != second


def test_the_advantages_and_caution_change_the_way():
    fields = set()
    for values in ({}, {'demonstration_advantage': 0.0}, {'practice_advantage': 0.9},
                   {'caution': 5.0}):
        learner = taught(SHOWN, WALLED.shape, WALLED, **values)
        practise(learner, WALLED, [(8, 4), (6, 0), (3, 0)])
        field = learner.refresh.field
        fields.add(field.q.tobytes() + field.vx.tobytes() + field.vy.tobytes())
    assert len(fields) == 4


def test_a_teacher_without_advantage_keeps_no_roundabout_way():
    roundabout = segment((1, 1), (6, 1), (6, 6), (1, 6))
    kept, free = (
        taught(roundabout, (8, 8), np.zeros((8, 8), np.int8), demonstration_advantage=advantage)
        for advantage in (0.4, 0.0))
    assert kept.refresh.certificate.fidelity == 1.0
    assert free.refresh.certificate.fidelity < 0.7
    assert headings_of(free.refresh.field)[1, 1] == 0


def test_a_dead_end_that_was_shown_is_left_once_it_is_known():
    occupancy = np.zeros((9, 16), np.int8)
    occupancy[3, 6:11] = occupancy[5, 6:11] = occupancy[4, 6] = 100
    learner = taught(segment((4, 14), (4, 1)), occupancy.shape)
    practise(learner, occupancy, [(4, 14)] * 4)
    assert learner.refresh.certificate.basin == 1.0
    assert len(learner.refresh.certificate.sinks) == 0


def test_a_demonstrated_cell_that_is_a_wall_is_no_prototype():
    learner = taught(segment((0, 0), (0, 5)), (3, 6))
    world = np.zeros((3, 6), np.int8)
    world[0, 3] = 100
    practise(learner, world, [(0, 0)])
    cells = learner.refresh.prototypes.cells.tolist()
    assert [0, 3] not in cells
    assert learner.refresh.certificate.fidelity == 1.0
    assert headings_of(learner.refresh.field)[0, 2] != 0


def test_a_wall_that_has_gone_gives_the_demonstration_back():
    learner = taught(segment((0, 0), (0, 5)), (3, 6))
    world = np.zeros((3, 6), np.int8)
    world[0, 3] = 100
    practise(learner, world, [(0, 0)])
    practise(learner, 0 * world, [(0, 1), (1, 2)])
    assert learner.refresh.field.known[0, 3] == 0
    assert headings_of(learner.refresh.field)[0, :5].tolist() == [0] * 5


@pytest.mark.parametrize('shape', [(1, 2), (2, 1), (1, 9), (9, 1)])
@pytest.mark.parametrize('profile', ['paper', 'full'])
def test_corridors_one_cell_wide_are_workspaces_too(shape, profile):
    end = (shape[0] - 1, shape[1] - 1)
    learner = taught(segment((0, 0), end), shape, np.zeros(shape, np.int8), profile=profile)
    assert learner.refresh.certificate.basin == 1.0
    for trial in practise(learner, np.zeros(shape, np.int8), [(0, 0), end]):
        assert trial.outcome == 'goal'


def test_without_a_demonstration_there_is_no_field():
    with pytest.raises(ValueError, match='before the first demonstration'):
        compose(Memory(Grid(3, 3, 1.0), Parameters()))
