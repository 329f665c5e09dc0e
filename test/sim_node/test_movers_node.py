"""What moves and changes, as the simulator's node shows it."""

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import OccupancyGrid
from visualization_msgs.msg import Marker, MarkerArray

from control_field.records import Outcome
from msgs_bridge.messages.markers import markers_from_discs
from msgs_bridge.messages.neighbourhoods import occupancy_from_map
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos
import ros_helpers
from simulator_peer import simulator
from world_maps.world import find_world, load_world


def test_a_door_closes_when_its_trial_comes_and_movers_are_drawn(ros_node, tmp_path):
    maps = ros_helpers.collect(ros_node, OccupancyGrid, 'map', qos.LATCHED)
    markers = ros_helpers.collect(ros_node, MarkerArray, 'movers', qos.LATCHED)
    trials = ros_node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
    truth = load_world(find_world('task2')).occupancy
    with simulator(ros_node, tmp_path, lockstep=True, world='task2', movers='door') as peer:
        peer.first_tick()
        peer.wait(lambda: maps, 'the map')
        ended = TrialStatus(State.ENDED, trial=5, outcome=Outcome.GOAL)
        trials.publish(status_from_trial(ended))
        peer.wait(lambda: len(maps) == 2, 'the map with another door')
        before, after = (occupancy_from_map(message)[1] for message in maps)
        assert (before == truth).all()
        changed = before != after
        assert {tuple(cell) for cell in zip(*changed.nonzero(), strict=True)} == {
            (10, 2), (10, 3), (10, 11), (10, 12)}
        # They are drawn once somebody looks, which the simulator may not know yet.
        peer.wait(lambda: markers or not peer.drive([(0.0, 0.0)]), 'the markers')
        (marker,) = markers[-1].markers
        assert marker.action == Marker.DELETE  # it comes after 30 s


def test_a_cylinder_for_what_is_there():
    there, gone = markers_from_discs([(1.0, 2.0, 0.15), None], 'odom').markers
    assert (there.action, gone.action) == (Marker.ADD, Marker.DELETE)
    assert (there.pose.position.x, there.pose.position.y, there.scale.x) == (1.0, 2.0, 0.3)
    assert there.id != gone.id
