"""The node `sim_node`: a simulated robot on the topics of a real one."""

import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock as RosClock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from control_field.robot.stop_rules import Timeout
from msgs_bridge.messages.markers import markers_from_discs
from msgs_bridge.messages.neighbourhoods import (
    grid_from_neighbourhood, map_from_occupancy, Neighbourhood)
from msgs_bridge.messages.poses import (
    check_frame, odometry_from_pose, Pose, pose_from_initialpose, stamp_from_seconds)
from msgs_bridge.messages.trial_status import State, trial_from_status
from msgs_bridge.messages.velocities import velocity_from_twist
from msgs_bridge.node import qos
from msgs_bridge.node.command_age import problem_with_age
from msgs_bridge.node.command_line import check_names, names_of, Program
from msgs_bridge.node.command_types import mismatch
from msgs_bridge.node.node_info import workspace_from_grid
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.node.reader_threads import ReaderThreads
from msgs_bridge.node.ros_parameters import declare_parameters_from
from msgs_bridge.node.run import run_node
from sim_node.diagnostics import status_from_simulation
from sim_node.loading import load, picture_of
from sim_node.robot import Placement
from sim_node.settings import FIXED, SimSettings
from sim_node.simulation import Simulation
from sim_node.world_change import WorldChange

#: How often the node looks after its peers, in seconds of the wall clock.
_CARE_PERIOD: Final = 0.5
#: How often a tick is published again for a reader that came late (lock-step).
_REPEATS: Final = 4
_LOG_PERIOD: Final = 5.0

PROGRAM: Final = Program(
    'sim_node', 'a simulated robot on a map: odometry, local grid, collisions, wheel slip.',
    '-p world:=task1 -p speed_factor:=2.0', names_of(SimSettings))


class SimNode(Node):
    """
    A simulated robot.

    Publishes `odom`, `neighbourhood`, `map`, `movers`, `contact`, `/clock` and `/diagnostics`;
    listens to `cmd_vel`, `initialpose` and `trial`; serves `~/reset` (robot at its start, contacts
    forgotten, the same random numbers again, what moves and changes begins anew). Every parameter
    is described in `sim_node.settings`; setting `world` or `movers` at run time changes the world
    around the robot, also if the file is the same and what it holds has changed. A robot that
    would stand in an obstacle then is set to the nearest free place; while a trial or a
    demonstration is recorded such a world is refused.

    A collision stops the robot where it touches. It is reported on the latched `contact`
    (std_msgs/Bool, on change, before the sensors of the tick it happened in), on `/diagnostics`
    and once in the log; the odometry of that tick has speed 0. Contact ends when the robot has
    moved away or is placed.

    Ticks last ``1 / rate`` of simulated time. In real time a busy machine makes that time slower,
    never coarser. In lock-step a tick waits for its answer; one that nobody answers is published
    again, with the same stamp, when a new reader of `odom` appears. `initialpose`, `~/reset` and
    another world give a new tick at once, in which nothing moves.

    Raises
    ------
    ValueError
        If a parameter or the world is wrong; the message is for the user.

    """

    def __init__(self, **options: Any) -> None:
        """Read the world and start."""
        super().__init__('sim_node', **options)
        self._threads = ReaderThreads(self)
        self._settings = declare_parameters_from(
            self, SimSettings, fixed=FIXED, on_change=self._on_change)
        check_names(self)
        self.add_on_set_parameters_callback(self._check_world)
        world, script, settings, notes = load(self._settings)
        self._warn(notes)
        self._simulation = Simulation(world, settings, script.movers, script.changes)
        self._period = 1.0 / self._settings.rate
        self._stale_told = False
        self._n_ticks = 1  # a stamp of 0 means "no time" to ROS
        self._n_refused = self._n_readers = self._repeats = self._unanswered = 0
        self._told_contact: bool | None = None
        self._commands = Timeout(self._settings.cmd_vel_timeout)
        if not self._settings.lockstep:
            self._threads.enable()
        self._peers = PeerMonitor(self, 'robot', threads=self._threads)
        self._world_change = WorldChange(
            self._simulation, self._peers.recorder, lambda: self.count_publishers(
                self.resolve_topic_name('trial')) > 0)
        self._state_world()
        self._make_topics()
        self._make_timers()
        self._publish_map()
        self._publish()
        self._say_what_is_here()
        self._threads.start()

    def _say_what_is_here(self) -> None:
        world, start = self._simulation.world, self._simulation.parameters.start
        pace = ('in lock-step, time stands still until a command answers' if (
            self._settings.lockstep) else f'in real time x {self._settings.speed_factor:g}')
        self.get_logger().info(
            f'world {world.name}, {world.size}, {pace}; the robot at ({start.x:g}, {start.y:g}) m '
            f'drives by {self._command_type.__name__} on {self.resolve_topic_name("cmd_vel")}, '
            f'which control_field_node passes on from teleop_node')

    def _state_world(self) -> None:
        self._peers.describe(workspace_from_grid(self._simulation.world.grid))

    def _warn(self, notes: list[str]) -> None:
        for note in notes:
            self.get_logger().warning(note)

    def _make_topics(self) -> None:
        lockstep = self._settings.lockstep
        self._odometry = self.create_publisher(
            Odometry, 'odom', qos.LOCKSTEP_PUB if lockstep else qos.ODOMETRY_PUB)
        # A lost local grid would stop a lock-step for good; who reads best effort is served as
        # well.
        self._local_grid = qos.create_quiet_publisher(
            self, OccupancyGrid, 'neighbourhood', qos.LOCKSTEP_PUB if lockstep else qos.SENSOR)
        self._map = self.create_publisher(OccupancyGrid, 'map', qos.LATCHED)
        self._movers = self.create_publisher(MarkerArray, 'movers', qos.LATCHED)
        self._contact = self.create_publisher(Bool, 'contact', qos.LATCHED)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._clock_topic = None
        if self._settings.has_clock:
            self._clock_topic = self.create_publisher(Clock, '/clock', 10)
        self._command_type = (
            TwistStamped if self._settings.is_stamped else Twist)
        self._threads.subscribe_small(
            self._command_type, 'cmd_vel', self._on_command, self._refuse,
            qos.LOCKSTEP if self._settings.lockstep else qos.COMMAND)
        self._threads.subscribe_small(
            PoseWithCovarianceStamped, 'initialpose', self._on_initialpose, self._refuse, qos.POSE)
        self._threads.subscribe_small(
            DiagnosticStatus, 'trial', self._on_trial, self._refuse, qos.LATCHED)
        self.create_service(Trigger, '~/reset', self._threads.locked(self._on_reset))

    @property
    def subscriptions(self) -> Any:
        """What the executor takes: all but what is heard in a thread aside."""
        return self._threads.for_executor(super().subscriptions)

    def _make_timers(self) -> None:
        # Timers run on the steady clock: with use_sim_time they would wait for themselves.
        steady = RosClock(clock_type=ClockType.STEADY_TIME)
        self._system_clock = RosClock(clock_type=ClockType.SYSTEM_TIME)
        self.create_timer(_CARE_PERIOD, self._threads.locked(self._care), clock=steady)
        self._ticker = None
        if not self._settings.lockstep:
            self._ticker = self.create_timer(
                self._period / self._settings.speed_factor,
                self._threads.locked(self._advance), clock=steady)

    # What comes in

    def _on_command(self, msg: Any) -> None:
        lockstep = self._settings.lockstep
        if lockstep and msg.header.stamp != self._stamp:
            return  # it answers another tick
        if not lockstep and (problem := self._problem_with_age(msg)):
            self._refuse_command(problem)
            return
        try:
            self._simulation.command(*velocity_from_twist(msg))
            self._commands.on_arrival(time.monotonic())
        except ValueError as error:
            self._refuse_command(str(error))
            return
        if lockstep:
            self._advance()

    def _problem_with_age(self, msg: Any) -> str:
        """Say that a command is too old; a fast simulation leaves it as long as a slow one."""
        settings = self._settings
        return problem_with_age(
            msg, (self._seconds(), self._system_clock.now().nanoseconds * 1e-9),
            settings.cmd_vel_timeout * max(settings.speed_factor, 1.0), 'cmd_vel',
            'cmd_vel_timeout')

    def _on_initialpose(self, msg: PoseWithCovarianceStamped) -> None:
        try:
            check_frame(msg.header.frame_id, self._settings.frame_id, 'initialpose')
            pose = pose_from_initialpose(msg)
            self._simulation.place(Placement(pose.x, pose.y, pose.yaw), 'initialpose')
        except ValueError as error:
            self._refuse(str(error))
            return
        self._next_tick()

    def _on_trial(self, msg: DiagnosticStatus) -> None:
        try:
            status = trial_from_status(msg)
        except ValueError as error:
            self._refuse(str(error))
            return
        self._world_change.on_status(status)
        if status.state == State.ENDED:
            self._simulation.on_trial_end(status.trial)
            if self._simulation.world is not self._shown:
                self._next_tick()

    def _on_reset(self, _: Any, response: Any) -> Any:
        try:
            self._simulation.reset()
        except ValueError as error:
            response.message = str(error)
            return response
        self._next_tick()
        response.success = True
        response.message = 'the robot stands at its start'
        return response

    def _refuse_command(self, problem: str) -> None:
        self._commands.pass_over(time.monotonic(), problem)
        self._refuse(problem)

    def _refuse(self, problem: str) -> None:
        self._n_refused += 1
        self.get_logger().warning(f'refused: {problem} ({self._n_refused} messages so far)',
                                  throttle_duration_sec=_LOG_PERIOD)

    # Parameters at run time

    def _check_world(self, parameters: list[Parameter]) -> SetParametersResult:
        """Read a new world before it is agreed to."""
        named = {parameter.name: parameter.value for parameter in parameters}
        try:
            self._world_change.check(self._settings, named)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _on_change(self, settings: SimSettings) -> None:
        with self._threads.lock:
            self._change(settings)

    def _change(self, settings: SimSettings) -> None:
        self._settings = settings
        new, notes = self._world_change.make(settings)
        self._warn(notes)
        if self._ticker is not None:
            self._ticker.timer_period_ns = round(1e9 * self._period / settings.speed_factor)
        if new is not None:
            self.get_logger().info(f'the world is now {new.world.name}, {new.world.size}')
            self._state_world()
            self._publish_map()
            self._next_tick()

    # Time

    def _advance(self) -> None:
        """Let one tick pass."""
        self._threads.check()
        self._simulation.tick(self._period)
        self._n_ticks += 1
        self._publish()
        self._tell_staleness()

    def _next_tick(self) -> None:
        """Show at once what has changed; in lock-step as a tick in which nothing moves."""
        if self._settings.lockstep:
            self._n_ticks += 1
            self._publish()

    def _seconds(self) -> float:
        if self._settings.has_clock:
            return self._n_ticks * self._period
        return self._system_clock.now().nanoseconds * 1e-9

    def _tell_staleness(self) -> None:
        stale = self._simulation.is_stale
        if stale and not self._stale_told and self._simulation.is_commanded:
            now = time.monotonic()
            why = self._commands.absence(now, 'command') if self._commands.is_ignored(
                now) else f'no command for {self._settings.cmd_vel_timeout:g} s'
            self.get_logger().warning(f'{why}: the robot stops')
        self._stale_told = stale

    # What goes out

    def _publish(self) -> None:
        """Publish everything about this tick: contact first, the odometry last."""
        seconds = self._seconds()
        self._stamp = stamp_from_seconds(seconds)
        self._unanswered = 0
        self._publish_contact()
        if self._clock_topic is not None:
            self._clock_topic.publish(Clock(clock=self._stamp))
        self._publish_sensors(seconds)
        if self._simulation.world is not self._shown:
            self.get_logger().info('the world has changed, as the file of movers says')
            self._publish_map()
        if self._simulation.movers.movers and self._movers.get_subscription_count():
            self._movers.publish(markers_from_discs(
                self._simulation.movers.discs, self._settings.frame_id))

    def _publish_sensors(self, seconds: float) -> None:
        robot, local_grid = self._simulation.robot, self._simulation.local_grid()
        frame_id = self._settings.frame_id
        self._local_grid.publish(grid_from_neighbourhood(
            Neighbourhood(seconds, local_grid.row, local_grid.col, local_grid.cells, frame_id,
                          local_grid.fine),
            self._simulation.world.grid))
        place, yaw = robot.variances
        pose = Pose(seconds, *robot.odometry, robot.speed, robot.turn_rate, frame_id)
        self._odometry.publish(odometry_from_pose(
            pose, self._settings.child_frame_id, (place, place, yaw)))

    def _publish_contact(self) -> None:
        touches = self._simulation.in_contact
        if touches == self._told_contact:
            return
        if touches:
            truth = self._simulation.robot.truth
            what = ('collision' if self._simulation.has_collided else
                    'something that moves has run into the robot')
            self.get_logger().warning(
                f'{what} at ({truth.x:.3f}, {truth.y:.3f}) m: the robot is stopped')
        self._told_contact = touches
        self._contact.publish(Bool(data=touches))
        self._publish_diagnostics()

    def _publish_map(self) -> None:
        world = self._shown = self._simulation.world
        self._map.publish(map_from_occupancy(*picture_of(world.pixels)))

    def _publish_diagnostics(self) -> None:
        status = status_from_simulation(
            self.get_fully_qualified_name(), self._simulation, self._n_refused, self._n_ticks)
        self._peers.add_to(status)
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._system_clock.now().to_msg()
        self._diagnostics.publish(array)

    # Care for the peers, by the wall clock

    def _care(self) -> None:
        self._publish_diagnostics()
        self._warn_of_other_type()
        if self._settings.lockstep:
            self._repeat_for_late_readers()

    def _repeat_for_late_readers(self) -> None:
        """Publish a tick that nobody answers again when somebody new has come to hear it."""
        n_readers = self._odometry.get_subscription_count()
        if n_readers > self._n_readers:
            self._repeats = _REPEATS
        self._n_readers = n_readers
        self._unanswered += 1
        if self._unanswered > 1 and self._repeats > 0:
            self._repeats -= 1
            self._publish_sensors(self._seconds())

    def _warn_of_other_type(self) -> None:
        """Say once a while which parameter to set when somebody commands with the other type."""
        sentence = mismatch(self, 'cmd_vel', self._command_type)
        if sentence:
            self.get_logger().warning(sentence, throttle_duration_sec=12 * _LOG_PERIOD)

    def close(self) -> None:
        """Hear no more, while ROS is still there."""
        self._threads.close()


def main(args: list[str] | None = None) -> None:
    """
    Run the node until SIGINT or SIGTERM.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument, a parameter or the world is wrong.

    """
    run_node(PROGRAM, SimNode, args)


if __name__ == '__main__':
    main()
