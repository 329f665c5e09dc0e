"""Two suites at once: in two namespaces of one domain, and on two domains without any."""

from contextlib import contextmanager, ExitStack

from diagnostic_msgs.msg import DiagnosticArray
import pytest
import ros_helpers
from rosbags.highlevel import AnyReader
from suite_helpers import Suite

from control_field.records import Outcome
from msgs_bridge.bag_folder import EpisodeKind
from msgs_bridge.episodes import read_episode
from msgs_bridge.tables import field_from_cloud

pytestmark = pytest.mark.slow


@contextmanager
def two_suites(folder, domains, namespaces):
    with ExitStack() as stack:
        suites = []
        for number, (domain, namespace) in enumerate(zip(domains, namespaces, strict=True)):
            path = folder / f'suite{number}'
            path.mkdir()
            suite = Suite(path, domain, stack, namespace=namespace)
            suite.start()
            suites.append(suite)
        yield suites


def odometry(suite):
    """Return where a suite's robot is, and when."""
    msg = suite.node.odometry
    place = msg.pose.pose.position
    return msg.header.stamp.sec, msg.header.stamp.nanosec, place.x, place.y


def topics_of(task):
    names = set()
    for episode in task.episodes():
        with AnyReader([episode.path]) as bag:
            names |= {connection.topic for connection in bag.connections}
    return names


def outcomes(task):
    return [read_episode(episode.path).record.outcome for episode in task.episodes()
            if episode.kind is EpisodeKind.TRIAL]


def is_quiet(suite):
    """Let a suite's node hear what has come meanwhile."""
    for _ in range(50):
        suite.node.wait_until(lambda: True, 'nothing')
        ros_helpers.spin_some(suite.node._node)


def drives_alone(mover, other):
    """Teach and try with one suite; the other's robot, time, field and bags stay as they are."""
    other.node.wait_for_peers()
    before, learner, bags = odometry(other), dict(other.node.learner), len(other.task.episodes())
    mover.demonstrate()
    mover.node.ask('learner_node/run_trials')
    mover.wait_for_revision(3)
    is_quiet(other)
    assert odometry(other) == before
    assert other.node.learner == learner
    assert len(other.task.episodes()) == bags
    assert outcomes(mover.task) == [Outcome.GOAL] * 2


def last_field(suite):
    suite.wait(lambda: field_from_cloud(suite.fields[-1]).revision == 3, 'the last field')
    return suite.live_bytes()


def check_apart(suites, namespaces):
    drives_alone(suites[0], suites[1])
    drives_alone(suites[1], suites[0])
    assert last_field(suites[0]) == last_field(suites[1])
    for suite, namespace in zip(suites, namespaces, strict=True):
        prefix = f'/{namespace}/' if namespace else '/'
        assert all(topic.startswith(prefix) and topic.count('/') == prefix.count('/')
                   for topic in topics_of(suite.task))
        assert suite.node.status.trial == 2


def test_on_one_domain_two_namespaces_keep_them_apart(ros_domain, ros_node, tmp_path):
    said = ros_helpers.collect(ros_node, DiagnosticArray, '/diagnostics', 1000)
    namespaces = ('left', 'right')
    with two_suites(tmp_path, (ros_domain, ros_domain), namespaces) as suites:
        check_apart(suites, namespaces)
        for _ in range(200):
            ros_helpers.spin_some(ros_node, 0.0)
    names = {status.name for array in said for status in array.status}
    assert names == {f'{namespace}/{name}' for namespace in namespaces for name in (
        'sim_node: robot', 'control_field_node: controller', 'learner_node: learner')}


def test_without_namespaces_two_domains_keep_them_apart(ros_domain, tmp_path):
    with ros_helpers.own_domain() as other:
        assert other != ros_domain
        with two_suites(tmp_path, (ros_domain, other), ('', '')) as suites:
            check_apart(suites, ('', ''))


def test_both_at_once_come_to_the_same_as_each_alone(ros_domain, tmp_path):
    namespaces = ('left', 'right')
    with two_suites(tmp_path, (ros_domain, ros_domain), namespaces) as suites:
        for suite in suites:
            suite.demonstrate()
        for suite in suites:
            suite.node.ask('learner_node/run_trials')
        for suite in suites:
            suite.wait_for_revision(3)
        assert last_field(suites[0]) == last_field(suites[1])
        assert [outcomes(suite.task) for suite in suites] == [[Outcome.GOAL] * 2] * 2
