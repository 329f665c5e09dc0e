"""Messages of any size reach a controller that drives: who guards is not held up."""

from contextlib import suppress

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
import pytest
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from sensor_msgs.msg import PointCloud2

from control_field_node.commands.velocity_output import GUARD_PERIOD
from controller_helpers import straight_field
from controller_peer import BEHIND, controller, Peer, simulator
from msgs_bridge.messages.trial_status import State
from msgs_bridge.node import qos
from ros_helpers import collect, DEADLINE, wait_until

LARGE = b'\x00\x01\x00\x00' + bytes(60_000_000)
#: Where what was lost is not sent again, nothing of 60 MB gets through.
MIDDLE = LARGE[:2_000_000]


def values_of(array):
    return {pair.key: pair.value for status in array.status if 'controller' in status.name
            for pair in status.values}


class Attacker:
    """Sends bytes to a controller, and reads what it says of itself on `/diagnostics`."""

    def __init__(self, node, robot, controller):
        self._node, self._processes, self._controller = node, (robot, controller), controller
        self._heard = collect(node, DiagnosticArray, '/diagnostics')
        self.works = []

    @property
    def values(self):
        return next(filter(None, map(values_of, reversed(self._heard))), {})

    def wait(self, predicate, what, deadline=DEADLINE):
        return wait_until(predicate, deadline, node=self._node, processes=self._processes,
                          what=what)

    def is_moving(self):
        return float(self.values.get('speed', 0)) > 0.02

    def send(self, messages):
        """Send until all is refused; note how long the thread that guards worked."""
        left = [(self._node.create_publisher(kind, topic, qos.LATCHED), message, words)
                for kind, topic, message, words in messages]
        for publisher, *_ in left:
            self.wait(publisher.get_subscription_count, f'who hears {publisher.topic_name}')

        def are_refused():
            left[:] = [each for each in left if each[2] not in self._controller.stderr]
            for publisher, message, _ in left:
                with suppress(rcl.RCLError):  # the last one is still on its way
                    publisher.publish(message)
            self._heard.clear()
            self.wait(lambda: self.values, 'diagnostics')
            self.works.append(float(self.values['guard_work_worst']))
            return not left

        self.wait(are_refused, 'refusals', deadline=150.0)


@pytest.fixture
def driven(ros_node, tmp_path):
    """Return an attacker of a controller that drives a robot through a long trial."""
    stamped = {'enable_stamped_cmd_vel': True}
    with simulator(tmp_path, stamped) as sim, controller(
            tmp_path, {'v_max': 0.04, **stamped}) as process:
        peer = Peer(ros_node, stamped=True).push(straight_field(BEHIND))
        peer.wait(peer.accepts_start, 'a start')
        attacker = Attacker(ros_node, sim, process)
        attacker.wait(attacker.is_moving, 'a robot that drives')
        yield attacker
        attacker.wait(attacker.is_moving, 'a robot that drives on')
        assert peer.status.state is State.RUNNING
        assert 'collision' not in sim.stderr


def test_who_guards_never_works_for_longer_than_from_look_to_look(driven):
    """What others on this machine do is not counted: it is processor time of that thread."""
    driven.send([(kind, topic, message, f'refused: {topic}: a message has')
                 for kind, topic, message in (
                     (PoseStamped, 'goal_pose', LARGE), (OccupancyGrid, 'neighbourhood', MIDDLE),
                     (Odometry, 'odom', MIDDLE), (TwistStamped, 'cmd_vel_teleop', MIDDLE),
                     (TwistStamped, 'cmd_vel', MIDDLE))])
    driven.send([(PointCloud2, 'control_field', LARGE, 'control field refused')])
    assert 0.0 < max(driven.works) < GUARD_PERIOD
