"""The live view: what is shown of what arrives, and what is not shown again."""

from types import SimpleNamespace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import numpy as np
import pytest

from control_field.grid import Grid
from control_field.records import ControlField, DECISION_DTYPE, Outcome, Prototypes
from msgs_bridge.messages.poses import Pose
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.status_tracker import StatusTracker
from page_node.server.view_hub import ViewHub
from page_node.view import live_view
from page_node.view.live_view import LiveView, Surroundings
from page_node.view.motion import Motion
from page_node.view.trail import Trail

GRID = Grid(4, 5, 0.25, -1.0, 2.0, 'odom')


class Shown(ViewHub):
    """Remembers what it was given."""

    def __init__(self):
        super().__init__()
        self.given = []

    def put(self, kind, content, arrays=None):
        self.given.append((kind, content))
        super().put(kind, content, arrays)

    def of(self, kind):
        return [content for given, content in self.given if given == kind]

    @property
    def trail(self):
        return self.trail_since((-1, 0))[0]


@pytest.fixture
def view(monkeypatch):
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(live_view.time, 'monotonic', lambda: clock.now)
    shown, around = Shown(), Surroundings(speeds=lambda: (0.2, 1.0))
    tracker = StatusTracker('/learner_node', '/control_field_node')
    return SimpleNamespace(
        live=LiveView(shown, tracker, around), shown=shown, around=around, tracker=tracker,
        clock=clock)


def tell(view, **values):
    view.tracker.on_diagnostics(DiagnosticArray(status=[DiagnosticStatus(
        name='learner_node: learner',
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])]),
        view.clock.now)


def test_the_state_is_shown_when_it_changes_and_not_again(view):
    view.live.refresh()
    view.live.refresh()
    state, = view.shown.of('state')
    assert state['nodes'] == {'learner': False, 'controller': False, 'robot': False}
    assert state['advice']['code'] == 'nobody'
    tell(view, phase='idle', task='kitchen', episodes=3, can_undo='true', simulation='true',
         revision=2, prototypes=5, basin=0.5, start='1 2 0.5', teach_here='1 2; 3 4')
    view.live.refresh()
    state = view.shown.of('state')[-1]
    assert (state['task'], state['episodes'], state['can_undo'], state['simulation']) == (
        'kitchen', 3, True, True)
    assert (state['revision'], state['prototypes'], state['basin'], state['fidelity']) == (
        2, 5, 0.5, None)
    assert (state['start'], state['teach_here']) == ([1.0, 2.0, 0.5], [[1.0, 2.0], [3.0, 4.0]])


@pytest.mark.parametrize('values', [
    {'episodes': '-3', 'revision': 'x'}, {'episodes': '9' * 30, 'revision': '1e9'}, {}])
def test_what_a_learner_says_that_is_no_number_counts_for_nothing(view, values):
    tell(view, phase='idle', **values)
    view.live.refresh()
    state, = view.shown.of('state')
    assert (state['episodes'], state['revision']) == (0, -1)


def test_a_robot_is_shown_at_the_rate_of_a_screen_and_less_often_where_it_stands(view):
    for tick in range(100):
        view.live.on_pose(Pose(0.01 * tick, 0.01 * tick, 0.0, 0.0), 100.0 + 0.01 * tick)
    assert 25 <= len(view.shown.of('robot')) <= 34
    view.shown.given.clear()
    for tick in range(100):
        view.live.on_pose(Pose(1.0, 0.99, 0.0, 0.0), 101.0 + 0.01 * tick)
    assert len(view.shown.of('robot')) <= 3


def test_a_robot_that_fell_silent_is_gone(view):
    view.live.on_pose(Pose(0.0, 0.0, 0.0, 0.0), view.clock.now)
    assert view.live.situation(view.clock.now).has_robot
    assert not view.live.situation(view.clock.now + 3.1).has_robot


def test_the_way_of_a_drive_and_of_a_trial_is_shown_and_no_other(view):
    def drive():
        for x in np.arange(0.0, 0.15, 0.03):
            view.live.on_pose(Pose(0.0, float(x), 0.0, 0.0), view.clock.now)
    drive()
    assert '[0.' not in view.shown.trail[0]
    tell(view, phase='demonstration')
    view.live.refresh()
    drive()
    assert '"kind":"demo"' in view.shown.trail[0]
    assert view.shown.trail[0].count('[0.') == 5
    tell(view, phase='idle')
    view.live.refresh()
    drive()
    assert view.shown.trail[0].count('[0.') == 5  # it stays until there is another
    view.live.on_trial(TrialStatus(State.RUNNING, 1))
    assert '"kind":"trial"' in view.shown.trail[0]
    drive()
    view.live.on_trial(TrialStatus(State.ENDED, 1, Outcome.GOAL))
    assert view.shown.trail[0].count('[0.') == 5


def test_how_a_trial_ended_stays_until_there_is_another(view):
    heard = []
    view.around.on_trial = heard.append
    view.live.on_trial(TrialStatus(State.ENDED, 1, Outcome.GOAL, steps=7))
    view.live.on_trial(TrialStatus(State.IDLE, 1))
    view.live.refresh()
    trial = view.shown.of('state')[-1]['trial']
    assert (trial['number'], trial['state'], trial['outcome'], trial['steps']) == (
        1, 'ended', 'goal', 7)
    assert len(heard) == 2


def test_of_another_task_neither_the_way_nor_how_it_ended_stays(view):
    tell(view, phase='idle', task='kitchen')
    view.live.refresh()
    view.live.on_trial(TrialStatus(State.RUNNING, 3))
    view.live.on_pose(Pose(1.0, 0.5, 2.5, 0.0), view.clock.now)
    assert '[0.5' in view.shown.trail[0]
    view.live.on_trial(TrialStatus(State.ENDED, 3, Outcome.GOAL))
    tell(view, phase='idle', task='hall')
    view.live.refresh()
    assert view.shown.of('state')[-1]['trial']['outcome'] == ''
    assert '"points":[]' in view.shown.trail[0]


def test_the_true_map_is_shown_in_simulation_only_whenever_that_is_known(view):
    view.live.on_map(GRID, np.zeros(GRID.shape, dtype=np.int8))
    tell(view, phase='idle', simulation='false')
    view.live.refresh()
    assert not view.shown.of('truth')
    tell(view, phase='idle', simulation='true')
    view.live.refresh()
    view.live.refresh()
    assert len(view.shown.of('truth')) == 1


def test_prototypes_wait_for_the_field_that_says_where_they_are(view):
    view.live.on_prototypes(Prototypes.none())
    assert not view.shown.of('prototypes')
    view.live.on_field(ControlField.void(GRID))
    assert len(view.shown.of('field')) == len(view.shown.of('prototypes')) == 1
    view.live.refresh()
    assert view.shown.of('state')[-1]['goal'] is None


def test_a_local_grid_that_is_the_same_is_not_shown_again(view):
    cells = np.zeros((3, 3), dtype=np.int8)
    local = Grid(3, 3, 0.25, 0.0, 0.0, 'odom')
    view.live.on_local_grid(local, cells)
    view.live.on_local_grid(local, cells.copy())
    view.live.on_local_grid(local, cells + np.int8(100))
    assert len(view.shown.of('sight')) == 2


def test_the_newest_decision_is_shown_with_its_place(view):
    decisions = np.zeros(2, dtype=DECISION_DTYPE)
    decisions['row'], decisions['col'], decisions['action'] = [0, 1], [0, 2], [0, 3]
    view.live.on_decisions(decisions)
    assert view.shown.of('decision') == [
        {'row': 1, 'col': 2, 'heading': 3, 'kind': 0, 'reward': 0}]
    view.live.on_field(ControlField.void(GRID))
    view.live.on_decisions(decisions)
    assert view.shown.of('decision')[-1]['x'] == -0.375
    view.live.on_decisions(decisions[:0])


class TestTrail:
    def test_points_are_apart(self):
        trail = Trail()
        assert [trail.add(x, 0.0) for x in (0.0, 0.001, 0.03)] == [True, False, True]

    def test_where_the_robot_was_set_elsewhere_it_begins_anew(self):
        trail = Trail()
        trail.add(0.0, 0.0)
        assert trail.add(2.0, 0.0) is None
        assert trail.points == [(2.0, 0.0)]

    def test_a_long_way_has_points_farther_apart(self):
        trail = Trail()
        answers = [trail.add(0.025 * index, 0.0) for index in range(20_000)]
        assert None in answers
        assert len(trail.points) <= 4000
        assert trail.points[0] == (0.0, 0.0)
        assert trail.points[-1][0] > 0.025 * 19_900


def test_a_driven_robot_that_does_not_move_is_stuck():
    motion = Motion()
    motion.on_driven(True, 10.0)
    assert not motion.is_stuck(11.0)
    assert motion.is_stuck(11.6)
    motion.on_pose(Pose(0.0, 0.0, 0.0, 0.0, v=0.1), 11.7)
    assert not motion.is_stuck(13.0)
    assert motion.is_stuck(13.3)
    motion.on_driven(False, 13.4)
    assert not motion.is_stuck(20.0)
