"""The profiles fit each other: whoever is meant to hear a topic does."""

from nav_msgs.msg import OccupancyGrid
import pytest
from rclpy.qos import qos_check_compatible, QoSCompatibility

from episode_store.rosbag2.metadata import known_qos
from msgs_bridge.node import qos
import ros_helpers


@pytest.mark.parametrize(('publisher', 'reader'), [
    ('ODOMETRY_PUB', 'SENSOR'), ('SENSOR', 'SENSOR'), ('COMMAND', 'COMMAND'),
    ('COMMAND', 'LOCKSTEP'), ('ODOMETRY_PUB', 'LOCKSTEP'),
    ('LATCHED', 'LATCHED'), ('EXPERIENCE', 'EXPERIENCE'), ('POSE', 'POSE'),
])
def test_publishers_and_readers_fit(publisher, reader):
    fit, reason = qos_check_compatible(getattr(qos, publisher), getattr(qos, reader))
    # What is left to the system's default is a warning, never an obstacle.
    assert fit != QoSCompatibility.ERROR, reason


@pytest.mark.parametrize(('profile', 'topics'), [
    ('ODOMETRY_PUB', 'odom'), ('SENSOR', 'neighbourhood'),
    ('COMMAND', 'cmd_vel cmd_vel_requested cmd_vel_teleop'),
    ('LATCHED', 'control_field prototypes trial map markers contact'),
    ('EXPERIENCE', 'experience'), ('POSE', 'goal_pose initialpose')])
def test_a_bag_is_played_with_the_profile_that_the_nodes_publish_with(profile, topics):
    live = getattr(qos, profile)
    for topic in topics.split():
        played = known_qos(f'/robot/{topic}')
        assert (played.history, played.depth, played.reliability, played.durability) == (
            live.history.name.lower(), live.depth, live.reliability.name.lower(),
            live.durability.name.lower()), topic


def test_who_is_heard_through_several_subscriptions_warns_of_none(ros_node, capfd):
    qos.create_quiet_publisher(ros_node, OccupancyGrid, 'neighbourhood', qos.SENSOR)
    for topic in ('neighbourhood', 'other'):
        qos.subscribe_all(ros_node, OccupancyGrid, topic, print,
                     (qos.RECORDING, qos.RECORDING_BEST_EFFORT))
    ros_node.create_publisher(OccupancyGrid, 'other', qos.SENSOR)
    said = []

    def warned():
        said.append(capfd.readouterr().err)
        return "on topic 'other', requesting incompatible QoS" in said[-1]

    # The one that is made as usual warns, and is made last: the other had time enough for it.
    ros_helpers.wait_until(warned, node=ros_node, what='the warning')
    assert 'neighbourhood' not in ''.join(said)
