"""What the robot reads decides whose parameter is wrong; real nodes on a real graph."""

from contextlib import ExitStack

from geometry_msgs.msg import Twist, TwistStamped
import pytest

from msgs_bridge.node.command_types import mismatch, remedy_for_publisher
import ros_helpers


@pytest.fixture
def graph(ros_domain):
    """Return a function that makes a node which publishes or reads commands."""
    with ExitStack() as stack:
        def make(name, **topics):
            node = stack.enter_context(ros_helpers.own_node(ros_domain, name))
            for verb, (kind, topic) in topics.items():
                if verb == 'reads':
                    node.create_subscription(kind, topic, lambda _: None, 1)
                else:
                    node.create_publisher(kind, topic, 1)
            return node
        yield make


def says(node, topic, kind, *words):
    """Wait until all is discovered; return the line."""
    return ros_helpers.wait_until(
        lambda: (line := mismatch(node, topic, kind)) and all(w in line for w in words) and line,
        node=node, what=str(words))


@pytest.mark.parametrize('topic', ['cmd_vel', 'cmd_vel_teleop'])
@pytest.mark.parametrize(('mine', 'other', 'value'), [
    (TwistStamped, Twist, 'true'), (Twist, TwistStamped, 'false')])
def test_where_the_robot_fits_the_other_publisher_is_to_be_changed(
        graph, topic, mine, other, value):
    controller = graph('controller', reads=(mine, 'cmd_vel'))
    graph('base', reads=(mine, 'cmd_vel'))
    graph('keyboard', publishes=(other, topic))
    line = says(controller, topic, mine, 'base')
    assert line.startswith(f'keyboard publishes {topic} as geometry_msgs/msg/{other.__name__} ')
    assert f'stamped:={value} (teleop_twist_keyboard)' in line
    assert f'enable_stamped_cmd_vel:={value} (teleop_node)' in line
    assert 'set enable_stamped_cmd_vel' not in line


def test_where_the_robot_has_the_other_type_this_node_is_to_be_changed(graph):
    controller = graph('controller', reads=(Twist, 'cmd_vel'))
    graph('learner_node', reads=(Twist, 'cmd_vel'))
    graph('keyboard', publishes=(TwistStamped, 'cmd_vel'))
    # A recorder is no robot.
    ros_helpers.wait_until(lambda: controller.count_subscribers('cmd_vel') == 2, node=controller)
    line = says(controller, 'cmd_vel', Twist, 'keyboard')
    assert line.endswith('set enable_stamped_cmd_vel:=true')
    graph('base', reads=(TwistStamped, 'cmd_vel'))
    line = says(controller, 'cmd_vel', Twist, 'base')
    assert line.endswith('set enable_stamped_cmd_vel:=true')


def test_every_remedy_names_the_parameter():
    assert 'enable_stamped_cmd_vel' in remedy_for_publisher('geometry_msgs/msg/Twist')
