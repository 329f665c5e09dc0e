"""Trials on another learner's field, and forged ones, are neither recorded nor learnt from."""

from contextlib import ExitStack

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
import pytest
from sensor_msgs.msg import PointCloud2

from bridge_helpers import demonstration_bag, GRID, random_decisions
from control_field.records import Outcome
from episode_store.task_folder import EpisodeKind, TaskFolder
from learner_node.session.outputs import Record, Say
from learner_node.session.phases import Phase
from msgs_bridge.messages.memory_identity import NOTHING, task_of
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import cloud_from_decisions, field_from_cloud
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos
from ros_helpers import collect, start_node, wait_until
from session_helpers import HERE

OWN, OTHER = 'kitchen:0123456789abcdef', 'hall:fedcba9876543210'


def status(state=State.RUNNING, trial=7, memory=OWN, **more):
    return TrialStatus(state, trial, revision=1, memory=memory, **more)


def idle(memory=OWN, trial=0):
    return status(State.IDLE, trial, memory)


def ended(trial=7, memory=OWN, outcome=Outcome.GOAL, decisions=0):
    return status(State.ENDED, trial, memory, outcome=outcome, decisions=decisions)


@pytest.fixture
def play(play):
    """Return a session that has a field of its own, and all its peers."""
    play.session.state.memory = OWN
    play('on_status', idle())
    return play


def said(outputs):
    return [output.text for output in outputs if isinstance(output, Say)]


def test_a_trial_that_others_start_on_the_own_field_is_recorded(play):
    assert play('on_status', status()) == [Record(EpisodeKind.TRIAL)]


@pytest.mark.parametrize('memory', ['', OTHER, 'kitchen:0000000000000000'])
def test_one_on_another_field_is_not_and_that_is_said_once(play, memory):
    told = []
    for trial in range(1, 20):
        assert play('on_status', status(trial=trial, memory=memory)) == []
        assert play.phase is Phase.IDLE
        told += said(play.wait(0.05 if trial % 2 else 2.5))
        told += said(play('on_status', ended(trial, memory)))
    assert len(told) == 1
    assert 'is not recorded: the controller d' in told[0]


def test_one_is_not_where_nothing_was_learnt(play):
    play.session.state.memory = NOTHING
    assert play('on_status', status(memory='')) == []
    assert play('on_status', status(trial=8, memory=OTHER)) == []


def test_no_trial_is_begun_while_the_controller_has_another_field(play):
    play('on_status', idle(OTHER))
    play('series.run', 1)
    assert 'task hall, not of kitchen' in play.session.state.describe()
    assert any('namespace' in text for text in said(play.wait(10.0)))
    assert play('on_status', idle()) != []
    assert play.phase is Phase.PLACING


def test_a_trial_is_broken_off_when_another_field_comes_in_the_middle(play):
    play('series.run', 1)
    play('on_pose', *HERE)
    play('on_start_response', True, '')
    play('on_status', status(trial=1))
    assert play.phase is Phase.TRIAL
    outputs = play('on_status', status(trial=1, memory=OTHER))
    assert 'trial 1 is broken off: the controller drives by the field of task hall' in said(
        outputs)[0]
    assert play.phase is Phase.WAITING


def test_a_trial_is_not_learnt_from_when_it_ends_on_another_field(play):
    play('series.run', 1)
    play('on_pose', *HERE)
    play('on_start_response', True, '')
    play('on_status', status(trial=1))
    assert 'broken off' in said(play('on_status', ended(1, OTHER)))[0]


def test_a_forged_word_of_another_trial_does_not_break_off_the_own(play):
    play('series.run', 1)
    play('on_pose', *HERE)
    play('on_start_response', True, '')
    play('on_status', status(trial=1))
    assert play('on_status', status(trial=3, memory=OTHER)) == []
    assert play.phase is Phase.TRIAL


class Forger:
    """Speaks on `trial` and `experience` as a controller would, and on `odom` as a robot."""

    def __init__(self, node):
        self.node, self.trial = node, 0
        self.fields = collect(node, PointCloud2, 'control_field', qos.LATCHED)
        self.statuses = node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
        self.decisions = node.create_publisher(PointCloud2, 'experience', qos.EXPERIENCE)
        self.odometry = node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)

    @property
    def memories(self):
        return {task_of(field_from_cloud(msg).memory): field_from_cloud(msg).memory
                for msg in self.fields}

    @property
    def revisions(self):
        return [field_from_cloud(msg).revision for msg in self.fields]

    def run(self, memory):
        """Run a whole trial without one word of truth in it."""
        self.trial += 1
        rows = random_decisions(GRID, 4, self.trial, self.trial)
        self._tell(State.RUNNING, memory)
        self.decisions.publish(cloud_from_decisions(rows, GRID))
        self._tell(State.RUNNING, memory, decisions=4)
        self._tell(State.ENDED, memory, outcome=Outcome.GOAL, decisions=4)
        self.odometry.publish(odometry_from_pose(Pose(float(self.trial), 1.0, 1.0, 0.0)))

    def _tell(self, state, memory, **more):
        self.statuses.publish(status_from_trial(TrialStatus(
            state, self.trial, revision=1, memory=memory, **more)))


def test_two_learners_in_one_namespace_keep_their_trials_apart(ros_domain, ros_node, tmp_path):
    tasks, grid = {}, {'rows': GRID.n_rows, 'cols': GRID.n_cols, 'resolution': GRID.resolution,
                       'origin_x': GRID.origin_x, 'origin_y': GRID.origin_y}
    forger = Forger(ros_node)
    with ExitStack() as stack:
        for name, start in (('kitchen', 200), ('hall', 190)):
            bag = demonstration_bag(tmp_path, start)
            bag.parent.rename(tmp_path / name)
            tasks[name] = TaskFolder(tmp_path, name)
            process = start_node('learner_node.node', tmp_path, {
                'bags': str(tmp_path), 'task': name, **grid}, name=f'learner_{name}')
            tasks[name, 'process'] = stack.enter_context(process)
        processes = [tasks[name, 'process'] for name in ('kitchen', 'hall')]
        wait_until(lambda: len(forger.memories) == 2, node=ros_node, processes=processes,
                   what='two fields')

        def refused():
            forger.run(forger.memories['kitchen'])
            return 'is not recorded: the controller drives by the field of task kitchen' in (
                processes[1].report()) and len(tasks['kitchen'].episodes()) > 1

        wait_until(refused, node=ros_node, processes=processes, what='a trial of one alone')
        for _ in range(20):
            forger.run('')
        wait_until(lambda: 'is not recorded: the controller does not say' in
                   processes[1].report(), node=ros_node, processes=processes, what='a refusal')
        wait_until(lambda: 'nothing was learnt' in processes[0].report(), node=ros_node,
                   processes=processes, what='what a made-up trial taught')
        assert len(set(forger.revisions)) == 1
        assert [each.number for each in tasks['hall'].episodes()] == [1]
        assert processes[1].report().count('is not recorded') <= 3
