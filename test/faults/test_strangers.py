"""Suites that meet by accident, and nodes that do not fit together, as processes: they say so."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy

from control_field.grid import Grid
from controller_helpers import straight_field
from controller_peer import controller, GOAL, Peer, simulator
from msgs_bridge.node.node_info import workspace_from_grid
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.teaching.answers import Answer
import ros_helpers
from teleop_node.node import TeleopNode


def say_as_learner(node, grid):
    """Let a node say of itself what a learner says; return what has to be called for it."""
    peers = PeerMonitor(node, 'learner')
    peers.describe(workspace_from_grid(grid))
    publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def tell():
        status = DiagnosticStatus(name=f'{node.get_name()}: learner')
        peers.add_to(status)
        publisher.publish(DiagnosticArray(status=[status]))
        ros_helpers.spin_some(node, 0.2)

    return tell


def test_two_simulators_and_another_workspace_are_said_by_all_and_nothing_drives(
        ros_node, tmp_path):
    tell = say_as_learner(ros_node, Grid(20, 20, 0.5))
    with simulator(tmp_path) as first, controller(tmp_path) as driver:
        peer = Peer(ros_node).meet().push(straight_field(GOAL, grid=Grid(20, 20, 0.5)))

        def all_say(processes, *words):
            def told():
                tell()
                return all(word in process.stderr for process in processes for word in words)

            ros_helpers.wait_until(told, processes=processes, what=f'{words} of all')

        all_say([first, driver], 'have different workspaces', 'with -p resolution:=0.25, or sim_n')
        answer = peer.call('start_trial')
        assert not answer.success
        assert 'sim_node and test_node have different workspaces' in answer.message
        with simulator(tmp_path, name='neighbour') as second:
            all_say([first, second, driver], '2 simulated robots in one namespace: /neighbour',
                    ' publish /odom: ', '2 publish /clock: /neighbour and /sim_node', '-r __ns:=')
            assert driver.stderr.count('2 simulated robots') == 1
            assert 'Two suites have met' in peer.call('start_trial').message


def test_teleop_asks_nobody_where_two_could_hear_it(ros_domain):
    context = rclpy.Context()
    # By a name of its own: what others in this domain had, and were killed with, is not asked.
    rclpy.init(args=['--ros-args', '-r', '__ns:=/alone'], context=context, domain_id=ros_domain)
    try:
        node = TeleopNode(None, context=context)
        services = node.service_clients
        services._peers.why_not = lambda operation: '2 learners in one namespace'
        for service in ('drop_last', 'run_trials', 'start_trial', 'discard_demonstration'):
            assert outcome(services.ask(service)) == Answer(
                False, '2 learners in one namespace', 'conflict')
        assert not outcome(services.ask('record_demonstration', True)).success
        # Nobody is there to stop anything, but it was tried.
        assert 'is not there' in outcome(services.ask('stop_trial')).message
        node.destroy_node()
    finally:
        context.try_shutdown()


def outcome(coroutine):
    """Return what a coroutine that waits for nothing comes to."""
    try:
        coroutine.send(None)
    except StopIteration as end:
        return end.value
    raise AssertionError('it waits for something')
