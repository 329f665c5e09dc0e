"""Two suites at once: in two namespaces of one domain, and on two domains without any."""

from contextlib import contextmanager, ExitStack

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rosbags.highlevel import AnyReader

from bridge_helpers import content_of
from control_field.records import Outcome
from episode_store.task_folder import EpisodeKind
from experience_cli.demo.processes import free_domain
import ros_helpers
from suite_helpers import Suite

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
    return [content_of(episode.path).record.outcome for episode in task.episodes()
            if episode.kind is EpisodeKind.TRIAL]


def settled(suite):
    """Hear all that is under way; return where the robot is, and when, once nothing more comes."""
    n_quiet = 0
    while n_quiet < 30:
        before = suite.node.odometry
        ros_helpers.spin_some(suite.node._node)
        n_quiet = n_quiet + 1 if suite.node.odometry is before else 0
    return odometry(suite)


def drives_alone(mover, other):
    """Teach and try with one suite; the other's robot, time, field and bags stay as they are."""
    other.node.wait_for_peers()
    # Where trials start is said once the simulator has answered: later than that all are there.
    other.wait(lambda: 'start' in other.node.learner, 'where trials start')
    before = settled(other)
    learner, bags = dict(other.node.learner), len(other.task.episodes())
    mover.demonstrate()
    mover.node.ask('learner_node/run_trials')
    mover.wait_for_revision(3)
    assert settled(other) == before
    assert other.node.learner == learner
    assert len(other.task.episodes()) == bags
    assert outcomes(mover.task) == [Outcome.GOAL] * 2


def last_field(suite):
    suite.wait(lambda: suite.newest_revision() == 3, 'the last field')
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
    with free_domain() as other:
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
