"""Commands of people: an old one moves nothing, and is not passed on as a new one."""

from geometry_msgs.msg import TwistStamped
import pytest
import rclpy
from rclpy.parameter import Parameter

from control_field_node.driving.trial_run import NOTHING
from control_field_node.node import ControlFieldNode
from controller_peer import controller, Peer, velocity_of
from msgs_bridge.messages.poses import stamp_from_seconds
from msgs_bridge.node import qos
import ros_helpers


def command(age, now, speed):
    msg = TwistStamped()
    if age is not None:
        msg.header.stamp = stamp_from_seconds(now.nanoseconds * 1e-9 - age)
    msg.twist.linear.x = speed
    return msg


def test_an_old_command_of_a_person_is_refused_once_and_one_without_a_stamp_passes(
        ros_node, tmp_path):
    with controller(tmp_path, {'enable_stamped_cmd_vel': True}) as process:
        peer = Peer(ros_node, stamped=True).meet()
        keys = ros_node.create_publisher(TwistStamped, 'cmd_vel_teleop', qos.COMMAND)
        peer.wait(keys.get_subscription_count, 'the controller')

        def send(age, speed):
            keys.publish(command(age, ros_node.get_clock().now(), speed))

        def refused():
            send(3600.0, 0.2)
            return 'is 3600.' in process.stderr

        peer.wait(refused, 'the refusal')
        for _ in range(20):
            send(3600.0, 0.2)
            ros_helpers.spin_some(ros_node)
        for age in (0.0, None):
            peer.commands.clear()

            def passed(age=age):
                send(age, 0.01)
                return peer.commands

            peer.wait(passed, 'a command that may be obeyed')
        assert all(velocity_of(msg)[0] <= 0.01 for msg in peer.commands)
        [line] = [text for text in process.stderr.splitlines() if (
            'refused: ' in text and 'cmd_vel_teleop' in text)]
        assert 'must be at most takeover_timeout (0.5 s)' in line
        assert 'the clocks of its sender and of this machine differ' in line


@pytest.mark.parametrize(('age', 'base_timeout', 'counts'), [
    (3600.0, 1.0, False), (-3600.0, 1.0, False), (1.5, 1.0, False), (1.5, 2.0, True),
    (0.7, 1.0, True), (0.7, 0.3, False), (0.0, 1.0, True), (None, 1.0, True)])
def test_who_sends_past_the_controller_what_the_base_drops_takes_nothing_over(
        ros_domain, monkeypatch, age, base_timeout, counts):
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=ros_domain)
    try:
        node = ControlFieldNode(context=context, use_global_arguments=False, parameter_overrides=[
            Parameter('enable_stamped_cmd_vel', value=True),
            Parameter('cmd_vel_timeout', value=base_timeout)])
        heard, said = [], []
        monkeypatch.setattr(node.supervisor.manual, 'on_external_command', lambda velocity, now: (
            heard.append(velocity), NOTHING)[1])
        monkeypatch.setattr(node.supervisor.refusals, 'refuse', said.append)
        node._on_command(command(age, node.get_clock().now(), 0.2))
        node.close()
        node.destroy_node()
    finally:
        context.try_shutdown()
    assert heard == ([(0.2, 0.0)] if counts else [])
    assert len(said) == (not counts)
    assert all(text.startswith('cmd_vel: ') and 'it takes no trial over' in text for text in said)
