"""Real nodes with a link between them that is late: robot and controller are processes."""

from pathlib import Path
import sys

from diagnostic_msgs.msg import DiagnosticArray
import pytest

from benchmarks.late_poses import straight_to
from control_field.grid import Grid
from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from controller_peer import controller, Peer, simulator
from msgs_bridge.messages.trial_status import State
import ros_helpers

#: A way around a corner of the obstacle.
GRID = Grid(20, 20, 0.25)
START, GOAL = GRID.world_from_cell(5, 7), (7, 10)
THERE = {name: f'{name}_there' for name in ('odom', 'neighbourhood', 'cmd_vel')}
LINK = Path(__file__).parent.parent / 'delayed_link.py'
LATE = {StopReason.LATE_POSES, StopReason.LATE_COMMANDS}


@pytest.mark.parametrize(('up', 'down'), [(0.3, 0.0), (0.0, 0.3)])
def test_300_ms_late_the_trial_reaches_the_goal_or_says_so_and_nothing_is_touched(
        ros_node, tmp_path, up, down):
    link = [sys.executable, str(LINK), str(up), str(down)]
    collisions = []
    peer = Peer(ros_node)

    def note(array):
        collisions.extend(pair.value for status in array.status if status.name.endswith('robot')
                          for pair in status.values if pair.key == 'collisions')

    ros_node.create_subscription(DiagnosticArray, '/diagnostics', note, 10)
    robot = {'publish_clock': False, 'start_x': START[0], 'start_y': START[1]}
    with simulator(tmp_path, robot, remappings=THERE), ros_helpers.Process(
            link, tmp_path), controller(tmp_path):
        peer.wait(lambda: peer.statuses, 'the controller')
        peer.push(straight_to(GOAL, GRID))
        peer.wait(peer.accepts_start, 'a start')
        peer.wait(lambda: peer.status.state is State.ENDED or peer.status.stop_reason in LATE,
                  'an end', deadline=180.0)
        n_before = len(collisions)
        peer.wait(lambda: len(collisions) > n_before + 2, 'what the robot says of it')
    assert peer.status.outcome is Outcome.GOAL or peer.status.stop_reason in LATE, peer.status
    assert set(collisions) == {'0'}
