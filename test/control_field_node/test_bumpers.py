"""A bumper is heard however it publishes."""

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool

from control_field.records import Outcome
from controller_peer import controller, Peer
from msgs_bridge.messages.trial_status import State, trial_from_status
import ros_helpers


@pytest.mark.parametrize('durability', ['VOLATILE', 'TRANSIENT_LOCAL'])
@pytest.mark.parametrize('reliability', ['RELIABLE', 'BEST_EFFORT'])
def test_one_contact_ends_one_trial(ros_node, tmp_path, reliability, durability):
    # A busy machine's halts are no pauses here.
    with controller(tmp_path, {'odom_timeout': 10.0, 'neighbourhood_timeout': 10.0}):
        peer = Peer(ros_node).meet()
        bumper = ros_node.create_publisher(Bool, 'contact', QoSProfile(
            depth=10, reliability=ReliabilityPolicy[reliability],
            durability=DurabilityPolicy[durability]))
        peer.push().drive()
        peer.wait(bumper.get_subscription_count, 'the controller')

        def is_told():
            # What nobody waits for may go out before the other end knows of it.
            bumper.publish(Bool(data=True))
            bumper.publish(Bool(data=False))
            ros_helpers.spin_some(ros_node)
            return peer.status.outcome is Outcome.COLLISION

        peer.wait(is_told, 'the end of the trial')
        peer.wait(peer.has_stopped, 'a standstill')
        peer.start()
        before = len(peer.rows)
        peer.wait(lambda: (peer.tick(), len(peer.rows) > before)[1], 'a decision')
        assert peer.status.state is State.RUNNING
        assert [status.trial for status in map(trial_from_status, peer.statuses)
                if status.state is State.ENDED] == [1]
