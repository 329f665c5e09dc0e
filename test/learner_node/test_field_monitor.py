"""What a second learner has left in the controller does not stay there."""

from diagnostic_msgs.msg import DiagnosticStatus
import pytest
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger

from bridge_helpers import demonstration_bag
from control_field.records import Outcome
from learner_node.session.field_monitor import FieldMonitor
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos
from ros_helpers import collect, start_node, wait_until

OWN = 3, 'kitchen:0123456789abcdef'
VOID = TrialStatus(State.IDLE, 0, revision=0, memory='')


def look(monitor, *arguments):
    """Let the monitor look; return whether the field is to be published."""
    monitor.look(*arguments)
    return monitor.must_publish


def publishes(*looks):
    monitor = FieldMonitor()
    return [look(monitor, status, *OWN, is_alone) for status, is_alone in looks]


@pytest.mark.parametrize('status', [
    VOID, TrialStatus(State.IDLE, 4, revision=3, memory='garden:0123456789abcdef'),
    TrialStatus(State.ENDED, 4, Outcome.GOAL, revision=2, memory=OWN[1])])
def test_another_field_is_answered_by_the_own_one_after_a_while_and_not_for_ever(status):
    said = publishes(*[(status, True)] * 50)
    assert said.index(True) == 2
    assert said.count(True) == 3


@pytest.mark.parametrize('seen', [
    (None, True), (TrialStatus(State.IDLE, 0, revision=-1), True), (VOID, False),
    (TrialStatus(State.IDLE, 4, revision=3, memory=OWN[1]), True),
    (TrialStatus(State.RUNNING, 4, revision=2, memory=OWN[1]), True)])
def test_nothing_is_said_where_it_is_there_or_cannot_be_known(seen):
    assert not any(publishes(*[seen] * 20))
    assert not any(publishes(*[(VOID, True), (VOID, True), seen] * 20))


def test_before_anything_was_learnt_there_is_nothing_to_say():
    monitor = FieldMonitor()
    assert not any(look(monitor, VOID, -1, 'nothing', True) for _ in range(20))


def test_a_large_field_has_time_to_arrive():
    monitor, last = FieldMonitor(), TrialStatus(State.IDLE, 4, revision=3, memory=OWN[1])
    assert not look(monitor, last, *OWN, True)
    new = 4, 'kitchen:00000000000000ff'
    said = [look(monitor, last, *new, True) for _ in range(40)]
    assert said.index(True) == 29
    assert sum(said) == 1
    arrived = TrialStatus(State.IDLE, 4, revision=4, memory=new[1])
    assert not look(monitor, arrived, *new, True)
    said = [look(monitor, last, *new, True) for _ in range(20)]
    assert said.index(True) == 2


def test_a_learner_gives_the_controller_its_field_again(ros_node, tmp_path):
    demonstration_bag(tmp_path / 'bags')
    ros_node.create_service(Trigger, 'control_field_node/start_trial', lambda _, answer: answer)
    ros_node.create_publisher(PointCloud2, 'experience', qos.EXPERIENCE)
    trials = ros_node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
    fields = collect(ros_node, PointCloud2, 'control_field', qos.LATCHED)
    with start_node('learner_node.node', tmp_path, {
            'bags': str(tmp_path / 'bags'), 'task': 'task1'}) as learner:
        def has_come(n):
            trials.publish(status_from_trial(VOID))
            return len(fields) >= n

        # Only now: what the controller has from before is given more time to be replaced.
        wait_until(lambda: fields, node=ros_node, processes=[learner], what='a field')
        wait_until(lambda: has_come(2), node=ros_node, processes=[learner], what='it once more')
        assert 'was a second learner there?' in learner.stderr
    first, again = map(field_from_cloud, fields[:2])
    assert first.memory == again.memory
    assert first.revision == again.revision
