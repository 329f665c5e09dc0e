from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.learning.certificate import certify
from control_field.learning.learner import Learner, with_old_headings
from control_field.parameters import Parameters
from control_field.records import DECISION_DTYPE, Outcome, Trial
from control_field.robot.policy import rules_of
from strategies import demonstration_of, few, practise, relearner, segment, taught

WALLED = np.zeros((7, 7), np.int8)
WALLED[3, 1:6] = 100
SHOWN = segment((1, 1), (1, 5), (5, 5))


def bytes_of(learner):
    field, prototypes = learner.refresh.field, learner.refresh.prototypes
    arrays = [getattr(field, name) for name in ('vx', 'vy', 'coherence', 'q', 'known', 'flags')]
    arrays += [getattr(prototypes, name)
               for name in ('cells', 'headings', 'q', 'episodes', 'stamps', 'demonstrated')]
    return b''.join([str((field.revision, field.goal)).encode(), *(a.tobytes() for a in arrays),
                     learner.memory.q.tobytes()])


@given(relearner(low=4, blind=True), st.sampled_from(['paper', 'full']), st.data())
@few
def test_the_same_episodes_give_the_same_bytes(learnt_bag, profile, data):
    occupancy, cells = learnt_bag
    free = np.argwhere(occupancy == 0).tolist()
    starts = data.draw(st.lists(st.sampled_from(free), max_size=3))
    learner = taught(cells, occupancy.shape, profile=profile, step_limit=200)
    after, trials = [bytes_of(learner)], []
    for number, start in enumerate(starts, 2):
        trials += practise(learner, occupancy, [start], number)
        after.append(bytes_of(learner))
    again = taught(cells, occupancy.shape, profile=profile, step_limit=200)
    relearnt = [bytes_of(again)]
    for trial in trials:
        again.add_trial(trial)
        relearnt.append(bytes_of(again))
    assert relearnt == after


def test_another_order_may_give_another_field():
    first, second = segment((2, 0), (2, 6)), segment((2, 5), (2, 1), (3, 1), (3, 6), (2, 6))
    fields = set()
    for order in ((first, second), (second, first)):
        learner = Learner(Grid(7, 7, 1.0), Parameters())
        for cells in order:
            learner.add_demonstration(demonstration_of(cells))
        fields.add(learner.refresh.field.vx.tobytes())
    assert len(fields) == 2


@given(relearner(low=4, blind=True), st.data())
@few
def test_a_trial_never_shrinks_the_basin_on_the_known_map(learnt_bag, data):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, step_limit=200, repair=data.draw(st.booleans()),
                     rehearsal=data.draw(st.booleans()), pull=data.draw(st.booleans()))
    free = np.argwhere(occupancy == 0).tolist()
    for number, start in enumerate(data.draw(st.lists(st.sampled_from(free), max_size=4)), 2):
        old = learner.refresh
        practise(learner, occupancy, [start], number)
        new = learner.refresh
        assert new.field.revision == number
        kept = with_old_headings(old.composition, new.composition).field
        before = certify(kept, learner.memory.demonstrated, 0, rules_of(learner.parameters))
        assert new.certificate.basin >= before.basin
        if new.pushed:
            assert new.reason == ''
        else:
            assert 'would shrink the basin' in new.reason
            assert np.array_equal(new.field.vx, old.field.vx)
            assert np.array_equal(new.field.known, learner.memory.known)


def test_a_refresh_that_would_shrink_the_basin_is_not_pushed():
    learner = taught(SHOWN, WALLED.shape, WALLED, repair=False, rehearsal=False, pull=False)
    rng, refused = np.random.default_rng(0), 0
    free = np.argwhere(WALLED == 0)
    for number in range(2, 40):
        practise(learner, WALLED, [free[rng.integers(len(free))]], number)
        refused += not learner.refresh.pushed
    assert refused > 0  # or the test above shows nothing


def test_a_trial_before_the_first_demonstration_is_refused():
    learner = Learner(Grid(3, 3, 1.0), Parameters())
    trial = Trial(np.zeros(0, DECISION_DTYPE), Outcome.GOAL)
    with pytest.raises(ValueError, match='before the first demonstration'):
        learner.add_trial(trial)
    for ask in (lambda: learner.next_starts(1, np.random.default_rng(0)),
                lambda: learner.trial_field(True), lambda: learner.teach_here(1)):
        with pytest.raises(ValueError, match='nothing was demonstrated yet'):
            ask()
    assert learner.refresh is None


def test_revisions_count_episodes_whatever_they_taught():
    learner = taught(SHOWN, WALLED.shape, WALLED)
    assert learner.refresh.field.revision == 1
    trial = practise(learner, WALLED, [(6, 0)])[0]
    assert learner.refresh.field.revision == 2
    learner.add_trial(Trial(trial.decisions.copy(), Outcome.ABORTED))
    assert learner.refresh.field.revision == 3
    learner.add_demonstration(demonstration_of(segment((6, 0), (6, 5), (5, 5))))
    assert learner.refresh.field.revision == 4


def test_a_refused_demonstration_leaves_the_field_as_it_was():
    learner = taught(SHOWN, WALLED.shape)
    before = bytes_of(learner)
    with pytest.raises(ValueError, match='ends in the cell where it began'):
        learner.add_demonstration(demonstration_of([(0, 0), (0, 1), (0, 0)]))
    assert bytes_of(learner) == before
    learner.add_trial(practise(taught(SHOWN, WALLED.shape), WALLED, [(1, 1)])[0])
    assert learner.refresh.field.revision == 2


def test_demonstrations_add_up_and_the_last_goal_is_the_goal():
    learner = taught(SHOWN, WALLED.shape)
    learner.add_demonstration(demonstration_of(segment((6, 0), (6, 6)), episode=2))
    refresh = learner.refresh
    assert refresh.field.goal == (6, 6)
    assert refresh.prototypes.demonstrated.sum() == len(SHOWN) - 1 + 6
    assert refresh.certificate.fidelity == 1.0
    assert refresh.certificate.basin == 1.0  # even from the old goal's way
    assert refresh.pushed


@pytest.mark.parametrize('profile', ['paper', 'full'])
def test_an_unreachable_start_is_given_up_and_does_no_harm(profile):
    world = np.zeros((7, 7), np.int8)
    world[4, :3] = world[5:, 2] = 100
    learner = taught(segment((0, 0), (0, 6)), (7, 7), profile=profile, step_limit=100)
    trial = practise(learner, world, [(6, 0)])[0]
    assert trial.outcome == Outcome.GAVE_UP
    assert practise(learner, world, [(0, 0)])[0].outcome == Outcome.GOAL
    if profile == 'full':
        assert trial.n_steps <= 30  # it knows when all ways are seen to be blocked
        assert learner.refresh.certificate.basin == 1.0


def test_the_exploration_field_is_the_full_profiles():
    for profile, curiosity, other in (('full', 0.8, True), ('full', 0.0, False),
                                      ('paper', 0.8, False)):
        learner = taught(SHOWN, WALLED.shape, WALLED, profile=profile, curiosity=curiosity)
        assert (learner.trial_field(True) is not learner.refresh.field) == other
        assert learner.trial_field(False) is learner.refresh.field
