from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Learner
from control_field.parameters import Parameters
from control_field.records import Outcome
from strategies import demonstration_of, few, practise, relearner, segment, taught

#: A room of two halves; the drive leads through the door in the middle of the wall.
SHAPE, DOOR, START, GOAL = (11, 11), (5, 5), (1, 5), (9, 5)
DRIVE = segment(START, GOAL)
STARTS = [(row, col) for row in range(5) for col in range(0, 11, 5)]


def room(*gaps):
    world = np.zeros(SHAPE, np.int8)
    world[5] = 100
    for gap in gaps:
        world[gap] = 0
    return world


def learner_of(**values):
    """Return a learner that knows the room, with its door."""
    learner = taught(DRIVE, SHAPE, room(DOOR), **values)
    practise(learner, room(DOOR), [(1, 1), (2, 9), (4, 0), (4, 10), (6, 0), (7, 10)])
    return learner


def headings_are_shown(field):
    """Return whether the field leads along the whole drive."""
    return all(field.vy[cell] > 0.99 for cell in DRIVE[:-1])


def successes(learner, world):
    runs = GridWorld(world, learner.parameters).trials(
        learner.trial_field(False), np.array(STARTS), 0)
    return (runs.outcome == 0).mean()


@given(relearner(), st.lists(st.integers(0, 63), min_size=3, max_size=6), st.booleans())
@few
def test_in_a_world_that_changes_relearning_gives_the_bytes_that_learning_gave(
        learnt_bag, places, exploring):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, map_memory=2)
    trials = []
    for number, place in enumerate(places):
        world = occupancy.copy()
        world.reshape(-1)[place % world.size] ^= 100  # something stands there, or is gone
        free = np.argwhere(world == 0)
        trials += practise(learner, world, [free[place % len(free)]], number + 2, 0, exploring)
    again = taught(cells, occupancy.shape, occupancy, map_memory=2)
    for trial in trials:
        again.add_trial(trial)
    for name in ('vx', 'vy', 'coherence', 'q', 'known', 'flags'):
        for first, second in ((again.refresh.field, learner.refresh.field),
                              (again.trial_field(exploring), learner.trial_field(exploring))):
            assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
    assert again.refresh.certificate.numbers() == learner.refresh.certificate.numbers()


def test_what_leaves_the_shown_way_gives_it_back():
    learner = learner_of()
    stands = room(DOOR)
    stands[2:4, 4:7] = 100
    for n in range(1, 4):
        practise(learner, stands, [START], 10 + n)
        field = learner.refresh.field
        assert not headings_are_shown(field)
        assert learner.refresh.certificate.basin == 1.0
    for n in range(4, 12):
        practise(learner, room(DOOR), [START], 10 + n)
    assert headings_are_shown(learner.refresh.field)


def test_who_stands_there_once_is_looked_for_once():
    learner = learner_of()
    stands = room(DOOR)
    stands[2:4, 4:7] = 100
    practise(learner, stands, [START], 11)
    assert headings_are_shown(learner.trial_field(False))
    assert not headings_are_shown(learner.refresh.field)
    practise(learner, room(DOOR), [START], 12)
    assert headings_are_shown(learner.refresh.field)


@pytest.mark.parametrize('place', [DOOR, GOAL])
def test_after_somebody_stood_in_the_only_door_or_on_the_goal_the_next_trial_succeeds(place):
    learner = learner_of()
    stands = room(DOOR)
    stands[place] = 100
    trial = practise(learner, stands, [START], 11)[0]
    assert trial.outcome == Outcome.GAVE_UP
    certificate = learner.refresh.certificate
    assert certificate.basin == 1.0
    assert certificate.leaning > 0.4
    assert list(place) in certificate.doubted.tolist()
    assert 'only if what is in doubt' in certificate.sentence()
    assert successes(learner, room(DOOR)) == 1.0


def test_a_door_that_closes_while_a_remembered_wall_opens_is_found():
    learner = learner_of()
    assert successes(learner, room((5, 9))) == 1.0
    practise(learner, room((5, 9)), [START], 11)
    assert GridWorld(room((5, 9)), learner.parameters).flow_home(learner.refresh.field)[START]


def test_what_was_sealed_for_three_trials_is_looked_at_again():
    learner = learner_of()
    for n in range(3):
        assert practise(learner, room(), [START], 11 + n)[0].outcome == Outcome.GAVE_UP
    field = learner.refresh.field
    assert learner.refresh.certificate.n_reachable == learner.refresh.certificate.n_free
    assert field.known[DOOR] == 99  # certain, but for its being the way out
    assert successes(learner, room(DOOR)) == 1.0
    assert successes(learner, room((5, 1))) == 1.0


def test_without_map_memory_it_stays_sealed():
    learner = learner_of(map_memory=0)
    practise(learner, room(), [START], 11)
    assert set(np.unique(learner.refresh.field.known)) <= {-1, 0, 100}
    assert successes(learner, room(DOOR)) < 0.1  # of those that stand before it


def test_old_walls_are_kept_around_as_certain_ones_are():
    fields = {}
    for map_memory in (1, 100):
        learner = Learner(Grid(*SHAPE, 1.0), Parameters(map_memory=map_memory))
        learner.add_demonstration(demonstration_of(DRIVE, room(DOOR)))
        practise(learner, room(DOOR), [(4, 0), (1, 5), (1, 5), (1, 5)])
        fields[map_memory] = learner.refresh.field
    assert (fields[1].known == 100).sum() < (fields[100].known == 100).sum()
    for name in ('vx', 'vy', 'q', 'coherence'):
        assert getattr(fields[1], name).tobytes() == getattr(fields[100], name).tobytes()
