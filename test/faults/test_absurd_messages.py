"""Absurd messages by the thousand, and nodes that stand still for a while: the work goes on."""

from contextlib import ExitStack
import math
import signal
import time

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField

from bridge_helpers import random_decisions, random_field, spoil
from control_field.grid import Grid
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.task_folder import EpisodeKind
from experience_cli.commands.learn import field_bytes
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import cloud_from_decisions, cloud_from_field
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos
from suite_helpers import relearnt, running_suite

pytestmark = pytest.mark.slow

GRID = Grid(20, 20, 0.25)
CODES = '\x1b]0;owned\x07\x1b[2J\nodom'
#: Longest time without a sign of life before the learner breaks a trial off, [s].
PATIENCE = 1.0


def spoilt(message, **values):
    for name, value in values.items():
        spoil(message, name.replace('__', '.'), value)
    return message


def odometry(**values):
    return spoilt(odometry_from_pose(Pose(1.0, 1.0, 1.0, 0.0)), **values)


def local_grid(**values):
    return spoilt(grid_from_neighbourhood(Neighbourhood(
        1.0, 5, 5, np.zeros((3, 3), np.int8)), GRID), **values)


def field(**values):
    return spoilt(cloud_from_field(random_field(GRID, 1)), **values)


def status(**values):
    msg = status_from_trial(TrialStatus(State.RUNNING, 9))
    for pair in msg.values:
        pair.value = values.get(pair.key, pair.value)
    return spoilt(msg, **{name: value for name, value in values.items() if hasattr(msg, name)})


def decisions(**values):
    rows = random_decisions(GRID, 3, 1)
    for name, value in values.items():
        rows[name] = value
    return cloud_from_decisions(rows, GRID)


def place(kind, value):
    msg = kind()
    pose = msg.pose.pose if kind is PoseWithCovarianceStamped else msg.pose
    pose.position.x = value
    return msg


def command(value):
    msg = TwistStamped()
    msg.twist.linear.x = value
    return msg


ABSURD = [
    *(('odom', odometry(**values)) for values in (
        {'pose__pose__position__x': math.nan}, {'pose__pose__position__x': 1e308},
        {'pose__pose__orientation__w': math.inf}, {'pose__pose__orientation__w': 0.0},
        {'header__stamp__sec': -5}, {'header__frame_id': CODES},
        {'header__frame_id': 'x' * 10_000}, {'twist__twist__linear__x': -math.inf})),
    *(('neighbourhood', local_grid(**values)) for values in (
        {'data': []}, {'info__width': 0}, {'info__width': 2}, {'info__width': 2**32 - 1},
        {'info__resolution': 0.0}, {'info__origin__position__x': math.nan},
        {'info__origin__position__x': 1e308}, {'header__frame_id': CODES})),
    ('control_field', PointCloud2()),
    *(('control_field', field(**values)) for values in (
        {'point_step': 0}, {'row_step': 2**32 - 1}, {'height': 2**32 - 1}, {'data': b''},
        {'is_bigendian': True}, {'fields': [PointField(name=CODES, datatype=7, count=1)]})),
    ('trial', DiagnosticStatus()),
    ('trial', DiagnosticStatus(name='trial', values=[KeyValue(key=CODES, value='x' * 10_000)])),
    *(('trial', status(**values)) for values in (
        {'state': CODES}, {'trial': '-5'}, {'trial': '9' * 5000}, {'stamp': 'nan'},
        {'outcome': 'goal'})),
    ('experience', PointCloud2()), ('experience', decisions(kind=200)),
    ('experience', decisions(row=-7)), ('experience', decisions(next_col=90_000)),
    ('experience', decisions(stamp=math.nan)),
    *(('cmd_vel_teleop', command(value)) for value in (math.nan, math.inf, 1e308)),
    ('goal_pose', place(PoseStamped, math.nan)),
    ('initialpose', place(PoseWithCovarianceStamped, math.nan)),
]
PROFILES = {'odom': qos.ODOMETRY_PUB, 'neighbourhood': qos.SENSOR, 'control_field': qos.LATCHED,
            'trial': qos.LATCHED, 'experience': qos.EXPERIENCE, 'cmd_vel_teleop': qos.COMMAND,
            'goal_pose': qos.POSE, 'initialpose': qos.POSE}


@pytest.fixture(scope='module')
def suite(ros_domain, tmp_path_factory):
    """Return a suite that was shown the way."""
    with running_suite(tmp_path_factory.mktemp('suite'), ros_domain,
                       peer_timeout=PATIENCE) as suite:
        suite.demonstrate()
        suite.wait_for_revision(1)
        yield suite


def test_absurd_messages_at_a_kilohertz_are_refused_in_few_words(suite):
    node = suite.node._node
    with ExitStack() as stack:
        publishers = {}
        for topic, message in ABSURD:
            if topic not in publishers:
                publishers[topic] = node.create_publisher(
                    type(message), topic, PROFILES[topic])
                stack.callback(node.destroy_publisher, publishers[topic])
        began = time.monotonic()
        for number in range(1500):
            topic, message = ABSURD[number % len(ABSURD)]
            publishers[topic].publish(message)
            time.sleep(max(began + number / 1000 - time.monotonic(), 0.0))
        # Whoever answers has come through all that was sent before.
        suite.wait(lambda: 'refused' in suite.processes['control_field_node'].report(), 'refusals')
    suite._check()
    for process in suite.processes.values():
        report = process.report()
        assert '\x1b' not in report
        assert 'Traceback' not in report, report
        assert len(report) < 50_000, report[:5000]
    assert len(suite.task.episodes()) == 1


def stop(suite, name, seconds):
    """Let a node stand still for a while, as a machine does that is suspended."""
    suite.processes[name].send(signal.SIGSTOP)
    try:
        time.sleep(seconds)  # how long it stands is what is tried
    finally:
        suite.processes[name].send(signal.SIGCONT)


@pytest.mark.parametrize('seconds', [0.3, 2 * PATIENCE])
def test_nodes_that_stand_still_lose_no_trial(suite, seconds):
    """Peers must be heard within half of that; 30 s are in `test_suspended.py`."""
    before = suite.newest_revision()
    suite.node.ask('learner_node/run_trials')
    for name in ('sim_node', 'control_field_node', 'learner_node'):
        suite.wait(lambda: suite.node.status is not None and suite.node.status.state in (
            State.RUNNING, State.ENDED), 'a trial')
        stop(suite, name, seconds)
    suite.wait_for_revision(before + 2)
    suite.wait(lambda: suite.newest_revision() == before + 2, 'the last field')
    trials = [Episode.at(episode.path).content.record.outcome for episode in suite.task.episodes()
              if episode.kind is EpisodeKind.TRIAL]
    assert trials.count(Outcome.GOAL) == before + 1, suite.report()
    assert set(trials) <= {Outcome.GOAL, Outcome.ABORTED}
    assert field_bytes(relearnt(suite.task).field()) == suite.live_bytes()
