from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.drives.loops import loop_erased
from control_field.grid import Grid
from control_field.headings import heading_from_step
from control_field.learning.grid_world import GridWorld
from control_field.learning.memory import Memory
from control_field.parameters import Parameters
from control_field.records import DECISION_DTYPE, Kind, Outcome, Trial
from strategies import demonstration_of, drives, practise, relearner, segment, steady, taught

OPEN = np.zeros((6, 6), np.int8)


def memory_of(*demonstrations, **values):
    memory = Memory(Grid(6, 6, 1.0), Parameters(profile='paper', **values))
    for number, cells in enumerate(demonstrations, 1):
        memory.add_demonstration(demonstration_of(cells, OPEN, number))
    return memory


def trial_of(cells, outcome=Outcome.GOAL, kind=Kind.FIELD, rewards=None, episode=9):
    rows = np.zeros(len(cells) - 1, DECISION_DTYPE)
    for row, here, there in zip(rows, cells[:-1], cells[1:], strict=True):
        row['row'], row['col'] = here
        row['next_row'], row['next_col'] = there
        row['action'] = heading_from_step(there[0] - here[0], there[1] - here[1])
    rows['kind'], rows['stamp'] = kind, np.arange(len(rows))
    if rewards is not None:
        rows['reward'] = rewards
    return Trial(rows, outcome, episode)


def state(memory):
    return b''.join(getattr(memory, name).tobytes()
                    for name in ('q', 'known', 'demonstrated', 'action', 'episode'))


@given(drives(OPEN))
@steady
def test_a_loop_erased_path_enters_no_cell_twice_and_keeps_both_ends(cells):
    path = np.array(cells, np.int32)
    kept = loop_erased(path)
    left = [tuple(cell) for cell in path[kept].tolist()]
    assert (np.diff(kept) > 0).all()
    assert len(set(left)) == len(left)
    assert left[-1] == cells[-1]
    assert left[0] == cells[0]
    assert np.abs(np.diff(path[kept], axis=0)).max(initial=0) <= 1
    assert np.array_equal(loop_erased(path[kept]), np.arange(len(kept)))
    for index, cell in zip(kept, left, strict=True):
        assert index == max(i for i, other in enumerate(cells) if other == cell)


def test_without_loops_nothing_is_erased():
    path = np.array(segment((0, 0), (0, 4), (4, 4)), np.int32)
    assert np.array_equal(loop_erased(path), np.arange(len(path)))
    assert loop_erased(np.zeros((0, 2), np.int32)).tolist() == []


@given(st.data())
@steady
def test_there_is_one_prototype_a_cell_and_the_last_action_wins(data):
    drive = data.draw(drives(OPEN).filter(lambda cells: cells[0] != cells[-1]))
    prototypes = memory_of(drive).prototypes()
    cells = [tuple(cell) for cell in prototypes.cells.tolist()]
    assert cells == sorted(set(cells))
    for cell, heading in zip(cells, prototypes.headings.tolist(), strict=True):
        last = max(i for i, other in enumerate(drive[:-1]) if other == cell)
        step = np.subtract(drive[last + 1], drive[last])
        assert heading == heading_from_step(*step.tolist())
    assert prototypes.demonstrated.all()


def test_where_demonstrations_cross_the_last_one_wins():
    across, down = segment((2, 0), (2, 5)), segment((5, 3), (0, 3))
    memory = memory_of(across, down)
    assert memory.goal == (0, 3)
    assert memory.action[2, 3] == heading_from_step(-1, 0)
    assert memory.action[2, 2] == heading_from_step(0, 1)
    assert len(memory.prototypes()) == len(across) - 1 + len(down) - 1 - 1
    assert memory.episode[2, 3] == 2


def test_a_demonstration_gives_its_steps_value_nearer_the_goal_more():
    memory = memory_of(segment((2, 0), (2, 5)), learning_rate=0.5, discount=0.9)
    assert memory.q[2, :5, 0] == pytest.approx([0.5 * 0.45**k for k in (4, 3, 2, 1, 0)])
    assert np.count_nonzero(memory.q) == 5


@pytest.mark.parametrize('cells', [[], [(1, 1)], [(1, 1), (1, 2), (2, 2), (1, 1)],
                                   [(5, 5), (6, 5)], [(0, 0), (0, -1)]])
def test_what_cannot_be_learnt_is_refused_and_changes_nothing(cells):
    memory = memory_of(segment((2, 0), (2, 5)))
    before = state(memory), memory.goal, memory.n_episodes
    with pytest.raises(ValueError, match='demonstration'):
        memory.add_demonstration(demonstration_of(cells))
    assert (state(memory), memory.goal, memory.n_episodes) == before


@pytest.mark.parametrize(('name', 'value'), [
    ('row', 6), ('col', -1), ('next_row', 99), ('next_col', -2), ('action', 8), ('action', -1)])
def test_decisions_outside_the_workspace_are_refused_and_change_nothing(name, value):
    memory = memory_of(segment((2, 0), (2, 5)))
    before = state(memory), memory.n_episodes
    rows = trial_of([(2, 2), (2, 3)]).decisions.copy()
    rows[name] = value
    with pytest.raises(ValueError, match=f'decision whose {name} is not 0 to'):
        memory.add_trial(Trial(rows, Outcome.GAVE_UP))
    assert (state(memory), memory.n_episodes) == before


@given(relearner())
@steady
def test_a_trial_that_the_field_alone_brought_home_changes_nothing(learnt_bag):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, profile='paper')
    before = {name: getattr(learner.memory, name).copy()
              for name in ('q', 'action', 'demonstrated')}
    field = learner.refresh.field
    trial = practise(learner, occupancy, [cells[0]])[0]
    assert trial.outcome == Outcome.GOAL  # what was demonstrated is driven again
    assert learner.refresh.reinforcements == 0
    for name, array in before.items():
        assert np.array_equal(getattr(learner.memory, name), array)
    for name in ('vx', 'vy', 'coherence', 'q', 'flags'):
        assert getattr(learner.refresh.field, name).tobytes() == getattr(field, name).tobytes()


def test_an_aborted_trial_teaches_nothing():
    memory = memory_of(segment((2, 0), (2, 5)))
    before = state(memory)
    assert memory.add_trial(trial_of(segment((4, 0), (4, 3)), Outcome.ABORTED, Kind.TAUGHT)) == 0
    assert state(memory) == before
    assert memory.n_episodes == 2


def test_a_stopped_trial_teaches_what_was_seen_and_what_a_person_drove():
    memory = memory_of(segment((2, 0), (2, 5)))
    q = memory.q.copy()
    kinds = [Kind.AVOID, Kind.TAUGHT, Kind.FIELD]
    trial = trial_of(segment((5, 0), (5, 3)), Outcome.STOPPED, kinds)
    assert memory.add_trial(trial) == 0
    assert np.array_equal(memory.q, q)
    assert memory.known[5, 2] == 0
    assert memory.demonstrated[5].tolist() == [-1, 0, -1, -1, -1, -1]
    assert memory.action[5].tolist() == [-1, 0, -1, -1, -1, -1]


def test_what_a_person_drove_in_a_trial_counts_as_demonstrated():
    memory = memory_of(segment((2, 0), (2, 5)))
    kinds = [Kind.FIELD, Kind.TAUGHT, Kind.TAUGHT, Kind.FIELD, Kind.FIELD]
    trial = trial_of([(2, 0), (2, 1), (3, 2), (2, 3), (2, 4), (2, 5)], kind=kinds)
    assert memory.add_trial(trial) == 1
    prototypes = memory.prototypes()
    at = {tuple(cell): i for i, cell in enumerate(prototypes.cells.tolist())}
    assert prototypes.demonstrated[[at[2, 1], at[3, 2]]].all()
    assert prototypes.headings[[at[2, 1], at[3, 2]]].tolist() == [1, 7]
    assert memory.demonstrated[2, 1] == 1


def test_the_payoff_is_carried_back_along_the_loop_erased_way():
    memory = memory_of(segment((5, 0), (5, 1)), learning_rate=1.0, discount=0.5)
    q = memory.q.copy()
    loop = [(2, 0), (2, 1), (3, 1), (3, 0), (2, 0), (1, 1), (1, 2)]
    assert memory.add_trial(trial_of(loop, kind=Kind.EXPLORE)) == 1
    changed = np.argwhere(memory.q != q).tolist()
    assert changed == [[1, 1, 0], [2, 0, 7]]
    assert memory.q[1, 1, 0] == 1.0
    assert memory.q[2, 0, 7] == 0.5
    assert memory.action[2, 1] == -1  # the loop leaves no prototype


@pytest.mark.parametrize('outcome', [Outcome.COLLISION, Outcome.GAVE_UP])
def test_a_failed_trial_is_paid_minus_one_and_leaves_no_prototype(outcome):
    memory = memory_of(segment((5, 0), (5, 1)), learning_rate=1.0)
    n = len(memory.prototypes())
    assert memory.add_trial(trial_of(segment((2, 0), (2, 3)), outcome)) == 1
    assert memory.q[2, 2, 0] == -1.0
    assert (memory.q[2, :2, 0] <= 0.0).all()
    assert len(memory.prototypes()) == n


def test_a_wall_that_has_gone_is_free_again():
    memory = memory_of(segment((2, 0), (2, 5)))
    for blocked, expected in ((1 << 0, 100), (0, 0)):
        rows = trial_of([(2, 2), (3, 2)], Outcome.GAVE_UP).decisions.copy()
        rows['blocked'] = blocked
        memory.add_trial(Trial(rows, Outcome.GAVE_UP))
        assert memory.known[2, 3] == expected


@given(relearner(blind=True), st.integers(0, 5))
@steady
def test_online_rewards_reach_the_memory_as_the_robot_gave_them(learnt_bag, seed):
    occupancy, cells = learnt_bag
    if occupancy[cells[0]]:
        return
    parameters = {'profile': 'paper', 'learning_rate': 1.0, 'discount': 0.0}
    learner = taught(cells, occupancy.shape, **parameters)
    world = GridWorld(occupancy, learner.parameters)
    trial, _ = world.trial(learner.refresh.field, cells[0], seed)
    kinds = trial.decisions['kind']
    paid = (kinds != Kind.BLOCKED).any() and not (
        trial.outcome == Outcome.GOAL and (kinds == Kind.FIELD).all())
    expected = trial.n_online_reinforcements + 1 if paid else 0
    assert learner.add_trial(trial).reinforcements == expected
    blocked = trial.decisions[trial.decisions['kind'] == Kind.BLOCKED]
    for row in blocked:
        assert learner.memory.q[row['row'], row['col'], row['action']] == -1.0
