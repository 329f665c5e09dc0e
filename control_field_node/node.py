"""The node `control_field_node`: turns the field into commands, trial by trial."""

from functools import partial
import time
from typing import Any, Final

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from std_msgs.msg import Bool, Empty
from std_srvs.srv import Trigger

from control_field.parameters import Parameters
from control_field.robot.limits import STANDSTILL, Velocity
from control_field.robot.stop_rules import StopReason
from control_field_node.commands.command_age_check import CommandAgeCheck
from control_field_node.commands.command_publishers import CommandPublishers
from control_field_node.commands.command_writer import CommandWriter
from control_field_node.commands.lockstep import TickBook
from control_field_node.commands.velocity_output import GUARD_PERIOD
from control_field_node.driving.trial_run import Answer, NOTHING
from control_field_node.inputs.field_reader import FieldReader, Outcome
from control_field_node.publishers import Publishers
from control_field_node.settings import DECISION_PARAMETERS, FIXED, Settings
from control_field_node.supervisor import Supervisor
from msgs_bridge.messages.neighbourhoods import cells_of_local_grid, neighbourhood_from_grid
from msgs_bridge.messages.poses import (
    check_frame, FRAME_OWNERS, Pose, pose_from_initialpose, pose_from_odometry,
    pose_from_pose_stamped, variances_from_covariance)
from msgs_bridge.messages.tables import OtherVersionError
from msgs_bridge.messages.velocities import velocity_from_twist
from msgs_bridge.node import qos
from msgs_bridge.node.command_line import check_names, names_of, Program
from msgs_bridge.node.graph import publishers_on
from msgs_bridge.node.node_info import method_from_parameters, Operation
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.node.reader_threads import ReaderThreads
from msgs_bridge.node.ros_parameters import declare_parameters_from
from msgs_bridge.node.run import quickest_executor, run_node

#: Steady time between two checks of what has not arrived, and between two diagnostics, [s].
_CHECK_PERIOD: Final = 0.1
_DIAGNOSTICS_PERIOD: Final = 1.0

PROGRAM: Final = Program(
    'control_field_node', 'the controller: drives a robot by the control field that the learner '
    'publishes,\ndecides cell by cell, and watches over safety (doc/safety.md).',
    '-p v_max:=0.2 -p enable_stamped_cmd_vel:=true', DECISION_PARAMETERS + names_of(Settings))


class ControlFieldNode(Node):
    """
    The controller.

    Raises
    ------
    ValueError
        If a parameter is wrong: one line that names it.

    """

    def __init__(self, **options: Any) -> None:
        """Declare, subscribe, wait."""
        super().__init__('control_field_node', **options)
        self._threads = ReaderThreads(self)
        parameters = declare_parameters_from(
            self, Parameters, names=DECISION_PARAMETERS, on_change=self._on_parameters)
        self._settings = declare_parameters_from(
            self, Settings, fixed=FIXED, on_change=self._on_settings)
        check_names(self)
        self.supervisor = Supervisor(self._settings, parameters, self._log)
        senders = self.supervisor.manual.publishers_on = partial(publishers_on, self)
        self._ages = CommandAgeCheck(self.supervisor.sensing.inputs, senders)
        self._book = TickBook()
        self._writer = CommandWriter(self._settings, self._book, self._time)
        self._command_publishers = CommandPublishers(self, self._writer.kind)
        trial = self.supervisor.trial
        self._fields = FieldReader(trial.states, lambda: trial.parameters_in_force)
        self._last_held = ''
        self._teleop_at: float | None = None
        self._out = Publishers(self, self._settings, self.supervisor, self._writer)
        if not self._settings.lockstep:
            self._threads.enable()
        self._peers = PeerMonitor(self, 'controller', threads=self._threads)
        self._on_parameters(parameters)
        self._make_subscriptions(self._threads)
        locked = self._threads.locked
        self.create_service(Trigger, '~/start_trial', locked(self._on_start))
        self.create_service(Trigger, '~/stop_trial', locked(self._on_stop))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_CHECK_PERIOD, locked(self._check), clock=steady)
        self.create_timer(_DIAGNOSTICS_PERIOD, locked(self._publish_diagnostics), clock=steady)
        if not self._settings.lockstep:
            self.create_timer(GUARD_PERIOD, locked(self._guard), clock=steady)
        self._log('info', f'waits for a control field; it drives by {self._writer.kind.__name__} '
                  f'on {self._out.commands.topic_name}')
        self._threads.start()

    def _make_subscriptions(self, threads: ReaderThreads) -> None:
        lockstep, refuse = self._settings.lockstep, self.supervisor.refusals.refuse
        self._fields.subscribe(self, threads, self._settle if lockstep else None)
        # A lost tick would stop a lock-step for good.
        sensed = qos.LOCKSTEP if lockstep else qos.SENSOR
        kind, is_ours = self._writer.kind, self._writer.acknowledge_raw
        subscribe = threads.subscribe_small
        fast = partial(subscribe, group='steers')  # best effort: few large messages get through
        fast(OccupancyGrid, 'neighbourhood', self._on_neighbourhood, refuse, sensed)
        fast(Odometry, 'odom', self._on_odometry, refuse, sensed)
        fast(kind, 'cmd_vel', self._on_command, refuse, qos.SENSOR, skip=is_ours)
        fast(kind, 'cmd_vel_teleop', self._on_teleop, refuse, qos.SENSOR)
        subscribe(PoseStamped, 'goal_pose', self._on_goal, refuse, qos.POSE)
        if self._settings.has_pose_topic:
            subscribe(PoseWithCovarianceStamped, self._settings.pose_topic,
                      self._on_localised_pose, refuse, *qos.LOCALISATIONS)
        # Messages of a fixed size:
        qos.subscribe_all(self, Bool, 'contact', threads.locked(self._on_contact), qos.CONTACTS)
        self.create_subscription(
            Empty, 'teleop_heartbeat', self.supervisor.heartbeat.on_heartbeat, qos.SENSOR)

    @property
    def subscriptions(self) -> Any:
        """Return what the executor takes: all but what threads of their own read."""
        return self._threads.for_executor(super().subscriptions)

    def _time(self) -> Time:
        return self.get_clock().now().to_msg()

    def _seconds(self) -> float:
        return float(self.get_clock().now().nanoseconds * 1e-9)

    def _on_parameters(self, parameters: Parameters) -> None:
        self.supervisor.trial.parameters = parameters  # a trial under way keeps its own
        self._peers.describe(method=method_from_parameters(parameters, DECISION_PARAMETERS))

    def _on_settings(self, settings: Settings) -> None:
        with self._threads.lock:
            self._settings = settings
            self.supervisor.change_settings(settings)

    def _log(self, level: str, text: str) -> None:
        # rclpy wants one line of source a level.
        if level == 'info':
            self.get_logger().info(text)
        elif level == 'warning':
            self.get_logger().warning(text)
        else:
            self.get_logger().error(text)

    def _settle(self, outcome: Outcome) -> None:
        """Put a field in force that was read, or log why not."""
        if isinstance(outcome, ValueError):
            self.supervisor.field.refuse(str(outcome))
            if isinstance(outcome, OtherVersionError):
                self._leave_field()
        elif self.supervisor.accept_field(outcome):
            self._read_local_grid(self._book.local_grid)
            self._out.publish_trial()
        else:
            self._leave_field()

    def _leave_field(self) -> None:
        """End a trial: a field that belongs to something else has come in the place of its own."""
        refusal = self.supervisor.field.refusal
        self._out.publish(self.supervisor.stop(StopReason.WRONG_FIELD, refusal))

    def _on_neighbourhood(self, msg: OccupancyGrid) -> None:
        if self._read_local_grid(msg):
            self._book.local_grid = msg  # only now: one that is refused takes no tick's place
            self._answer_tick()

    def _read_local_grid(self, msg: OccupancyGrid | None) -> bool:
        """Read a neighbourhood; before there is a field it lies on cells of its own."""
        if msg is None:
            return False
        try:
            grid = self.supervisor.grid or cells_of_local_grid(msg, self._settings.robot_radius)
            neighbourhood = neighbourhood_from_grid(
                msg, grid, bounded=self.supervisor.trial.run is not None)
        except ValueError as error:
            self.supervisor.refusals.refuse(str(error))
            self.supervisor.sensing.inputs.local_grid.pass_over(time.monotonic(), str(error))
            return False
        self.supervisor.on_neighbourhood(neighbourhood, time.monotonic(), grid)
        return True

    def _on_odometry(self, msg: Odometry) -> None:
        now, clock = time.monotonic(), self._seconds()
        inputs = self.supervisor.sensing.inputs
        try:
            pose, grid = pose_from_odometry(msg), self.supervisor.grid
            if self._settings.lockstep and grid is not None:
                check_frame(pose.frame_id, grid.frame_id, 'odom', FRAME_OWNERS)
        except ValueError as error:
            if self._settings.lockstep and not self._book.is_newer(msg):
                inputs.refusals.refuse(str(error))  # of no tick that waits for an answer
                inputs.odometry.pass_over(now, str(error))
            else:
                self._stand(self.supervisor.on_bad_odometry(str(error), now), msg)
            return
        if self._settings.lockstep:
            self._take_tick(msg, pose, now)
        elif problem := inputs.poses.check(pose, clock):
            inputs.odometry.pass_over(now, problem)
        else:
            self._book.odometry = msg
            self._out.publish(self.supervisor.on_pose(pose, now, clock), msg)

    def _take_tick(self, msg: Odometry, pose: Pose, now: float) -> None:
        """Lock-step: keep a pose until the neighbourhood of its stamp is there."""
        if self._book.is_answered(msg):
            return
        self._book.odometry = msg
        if self.supervisor.trial.run is not None:
            self._answer_tick()
            return
        self.supervisor.on_pose(pose, now)
        if self._book.owes_stop:
            self._writer.send(STANDSTILL, msg)

    def _answer_tick(self) -> None:
        """Lock-step: answer a tick, once, when both messages of it have come."""
        if (self._settings.lockstep and self.supervisor.trial.run is not None
                and self._book.is_open()):
            odometry = self._book.odometry
            self._stand(self.supervisor.on_pose(
                pose_from_odometry(odometry), time.monotonic()), odometry)

    def _stand(self, answer: Answer, odometry: Odometry) -> None:
        """Publish an answer; in lock-step a standstill where there is none, unless taken over."""
        trial = self.supervisor.trial
        if self._settings.lockstep and answer.velocity is None and trial.run is not None and (
                trial.pause_reason is not StopReason.TAKEN_OVER):
            answer = Answer(STANDSTILL, answer.rows)
        self._out.publish(answer, odometry)

    def _read_velocity(self, msg: Any) -> Velocity | None:
        try:
            return velocity_from_twist(msg)
        except ValueError as error:
            self.supervisor.refusals.refuse(str(error))
            return None

    def _on_command(self, msg: Any) -> None:
        velocity = self._read_velocity(msg)
        if velocity is None or self._writer.acknowledge(msg, velocity):
            return
        trial, manual = self.supervisor.trial, self.supervisor.manual
        if trial.run is not None and self._command_publishers.have_changed:
            self._look_at_publishers()
        if trial.run is not None and self._command_publishers.have_namesake:
            self._halt_for_rival('another controller')
        elif not self._check_age(msg, 'cmd_vel'):  # the base drops it, too: nobody drives by it
            self._out.publish(manual.on_external_command(velocity, time.monotonic()))

    def _halt_for_rival(self, name: str) -> None:
        """End a trial: there is a publisher on `cmd_vel` that must not be there."""
        self._out.publish(self.supervisor.trial.halt(
            StopReason.OTHER_PUBLISHER, f'{name} publishes cmd_vel, too'))

    def _check_age(self, msg: Any, topic: str) -> str:
        """Return why a command was sent too long ago to be obeyed."""
        return self._ages.check(msg, topic, self._settings, self._seconds(), self._book.odometry,
                                time.monotonic())

    def _on_teleop(self, msg: Any) -> None:
        velocity = self._read_velocity(msg)
        if velocity is None:
            return
        supervisor = self.supervisor
        if problem := self._check_age(msg, 'cmd_vel_teleop'):
            if supervisor.trial.run is None:  # the person wonders why nothing moves
                supervisor.output.held = supervisor.output.held or problem
                self._teleop_at = time.monotonic()
            return
        now = time.monotonic()
        # Whoever has stood for long begins gently.
        dt = min(now - self._writer.sent_at, 0.1 if self._teleop_at is None else 0.5)
        self._teleop_at = now
        is_due = not self._settings.lockstep or self._book.is_open()
        answer = supervisor.manual.on_teleop_command(velocity, now, dt) if is_due else NOTHING
        if answer.velocity is not None or supervisor.trial.run is None:
            self._out.publish_request(velocity, self._time())
        self._out.publish(answer)

    def _on_contact(self, msg: Bool) -> None:
        self._out.publish(self.supervisor.on_contact(msg.data, time.monotonic()))

    def _on_goal(self, msg: PoseStamped) -> None:
        try:
            goal = pose_from_pose_stamped(msg)
            self.supervisor.field.on_goal(goal.x, goal.y, goal.frame_id)
        except ValueError as error:
            self.supervisor.refusals.refuse(str(error))

    def _on_localised_pose(self, msg: PoseWithCovarianceStamped) -> None:
        name, now = self._settings.pose_topic, time.monotonic()
        try:
            pose = pose_from_initialpose(msg, name)
            variances = variances_from_covariance(msg.pose.covariance, name)
        except ValueError as error:
            self.supervisor.sensing.refuse_localised_pose(str(error), now)
            return
        self.supervisor.sensing.on_localised_pose(pose, variances, now)

    def _on_start(self, _: Any, response: Any) -> Any:
        others = self._command_publishers.others if self._settings.exclusive_cmd_vel else []
        response.message = (
            f'{others[0]} publishes cmd_vel, too, and exclusive_cmd_vel is set' if others
            else self._peers.why_not(Operation.DRIVE) or self.supervisor.start(time.monotonic()))
        response.success = not response.message
        if response.success:
            response.message = self.supervisor.status.sentence
            self._book.owes_stop = False
            self._out.publish_trial()
            self._answer_tick()
        return response

    def _on_stop(self, _: Any, response: Any) -> Any:
        ran = self.supervisor.trial.run is not None
        answer = self.supervisor.stop()
        self._out.publish(answer)
        response.success = ran or answer.velocity is not None
        response.message = 'no trial is running'
        if ran:
            response.message = self.supervisor.status.sentence
        elif response.success:
            response.message = 'the robot stands until the keys are let go'
        return response

    def _check(self) -> None:
        """Look for what has not arrived, and for who has let go."""
        now = time.monotonic()
        self._out.publish(self.supervisor.check_inputs(now))
        if self.supervisor.manual.has_let_go(now):
            self._answer_tick()
        if self._teleop_at is not None and now - self._teleop_at > (
                self._settings.takeover_timeout):
            self._teleop_at = None
            self._out.publish(self.supervisor.manual.release())
        if self._command_publishers.have_changed:
            self._look_at_publishers()
        if self.supervisor.output.held != self._last_held:  # a person wonders what holds it
            self._publish_diagnostics()

    def _guard(self) -> None:
        """Take the last command back if the robot must not follow it until the next pose."""
        self._threads.check()
        now, supervisor = time.monotonic(), self.supervisor
        supervisor.output.timing.on_guard(now, time.thread_time(), supervisor.is_driving)
        self._out.publish(supervisor.guard(now, self._seconds()))
        if (outcome := self._fields.take_finished(supervisor.field.current)) is not None:
            self._settle(outcome)

    def _look_at_publishers(self) -> None:
        """Note who is on `cmd_vel`, and log once which parameter to set for another type."""
        if line := self._command_publishers.update():
            self._log('warning', line)
        if self._command_publishers.others and self._settings.exclusive_cmd_vel:
            self._halt_for_rival(self._command_publishers.others[0])

    def _publish_diagnostics(self) -> None:
        self._look_at_publishers()
        self._last_held = self.supervisor.output.held
        self._out.publish_diagnostics(self._command_publishers, self._peers)

    def close(self) -> None:
        """Leave the robot standing, whatever has happened; then publish how the trial ended."""
        with self._threads.lock:
            self._threads.mute()
            self._writer.send_now(STANDSTILL, self._book.odometry)
        patience = Duration(nanoseconds=200_000_000)
        self._out.commands.wait_for_all_acked(patience)
        self.supervisor.stop(StopReason.SHUTDOWN)
        self._out.publish_trial()
        self._out.trials.wait_for_all_acked(patience)
        self._threads.close()


def main(args: list[str] | None = None) -> None:
    """
    Run the node until SIGINT or SIGTERM; a standstill goes out before it ends.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong.

    """
    run_node(PROGRAM, ControlFieldNode, args, quickest_executor())


if __name__ == '__main__':
    main()
