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
from control_field_node.answer import Answer
from control_field_node.command_ages import CommandAges
from control_field_node.commands import CommandWriter
from control_field_node.field_reader import FieldReader, Outcome
from control_field_node.lockstep import TickBook
from control_field_node.outbox import Outbox
from control_field_node.placing import read_place
from control_field_node.reports import CommandPublishers
from control_field_node.settings import DECISION_PARAMETERS, FIXED, Settings
from control_field_node.standing import drives
from control_field_node.supervisor import Supervisor
from control_field_node.wheels import GUARD_PERIOD
from msgs_bridge.messages.neighbourhoods import cells_of_local_grid, neighbourhood_from_grid
from msgs_bridge.messages.poses import (
    check_frame, FRAME_OWNERS, Pose, pose_from_odometry, pose_from_pose_stamped)
from msgs_bridge.messages.tables import OtherVersionError
from msgs_bridge.messages.velocities import velocity_from_twist
from msgs_bridge.node import qos
from msgs_bridge.node.command_line import check_names, names_of, Program
from msgs_bridge.node.graph import publishers_on
from msgs_bridge.node.node_info import method_from_parameters, Operation
from msgs_bridge.node.parameters import declare_parameters_from
from msgs_bridge.node.peers import PeerMonitor
from msgs_bridge.node.reader_threads import ReaderThreads
from msgs_bridge.node.run import quickest_executor, run_node

#: How often the node looks for what has not come, and tells how it stands, [s] of the wall clock.
_WATCH_PERIOD: Final = 0.1
_TELL_PERIOD: Final = 1.0

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
        self.supervisor.who = partial(publishers_on, self)
        self._ages = CommandAges(self.supervisor.intake, self.supervisor.who)
        self._book = TickBook()
        self._writer = CommandWriter(self._settings, self._book, self._time)
        self._command_publishers, self._fields = CommandPublishers(), FieldReader()
        self._told_held = ''
        self._teleop_at: float | None = None
        self._out = Outbox(self, self._settings, self.supervisor, self._writer)
        if not self._settings.lockstep:
            self._threads.enable()
        self._peers = PeerMonitor(self, 'controller', threads=self._threads)
        self._on_parameters(parameters)
        self._make_subscriptions(self._threads)
        locked = self._threads.locked
        self.create_service(Trigger, '~/start_trial', locked(self._on_start))
        self.create_service(Trigger, '~/stop_trial', locked(self._on_stop))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_WATCH_PERIOD, locked(self._watch), clock=steady)
        self.create_timer(_TELL_PERIOD, locked(self._tell), clock=steady)
        if not self._settings.lockstep:
            self.create_timer(GUARD_PERIOD, locked(self._guard), clock=steady)
        self._log('info', f'waits for a control field; it drives by {self._writer.kind.__name__} '
                  f'on {self._out.commands.topic_name}')
        self._threads.start()

    def _make_subscriptions(self, threads: ReaderThreads) -> None:
        lockstep, refuse = self._settings.lockstep, self.supervisor.intake.refuse
        self._fields.hear(self, self._settle if lockstep else None)
        # A lost tick would stop a lock-step for good.
        sensed = qos.LOCKSTEP if lockstep else qos.SENSOR
        kind = self._writer.kind
        subscribe = threads.subscribe_small
        fast = partial(subscribe, group='steers')  # best effort: few large messages get through
        fast(OccupancyGrid, 'neighbourhood', self._on_neighbourhood, refuse, sensed)
        fast(Odometry, 'odom', self._on_odometry, refuse, sensed)
        fast(kind, 'cmd_vel', self._on_command, refuse, qos.SENSOR, skip=self._writer.is_echo)
        fast(kind, 'cmd_vel_teleop', self._on_teleop, refuse, qos.SENSOR)
        subscribe(PoseStamped, 'goal_pose', self._on_goal, refuse, qos.POSE)
        if self._settings.has_pose_topic:
            subscribe(PoseWithCovarianceStamped, self._settings.pose_topic,
                      partial(read_place, self.supervisor), refuse, *qos.LOCALISATIONS)
        # These are of a fixed size, whatever comes.
        qos.hear_all(self, Bool, 'contact', threads.locked(self._on_contact), qos.CONTACTS)
        self.create_subscription(
            Empty, 'teleop_heartbeat', lambda _: self.supervisor.heartbeat.saw(), qos.SENSOR)

    @property
    def subscriptions(self) -> Any:
        """What the executor takes: all but what is heard in a thread aside."""
        return self._threads.for_executor(super().subscriptions)

    def _time(self) -> Time:
        return self.get_clock().now().to_msg()

    def _on_parameters(self, parameters: Parameters) -> None:
        self.supervisor.parameters = parameters  # a trial under way keeps its own
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
        """Take over a field that was read, or say why not."""
        if isinstance(outcome, ValueError):
            self.supervisor.refuse_field(str(outcome))
            if isinstance(outcome, OtherVersionError):
                self._leave_field()
        elif self.supervisor.accept_field(outcome):
            self._read_local_grid(self._book.local_grid)
            self._out.tell_trial()
        else:
            self._leave_field()

    def _leave_field(self) -> None:
        """End a trial: a field that belongs to something else has come in the place of its own."""
        supervisor = self.supervisor
        self._publish(supervisor.stop(StopReason.WRONG_FIELD, supervisor.refusal))

    def _on_neighbourhood(self, msg: OccupancyGrid) -> None:
        if self._read_local_grid(msg):
            self._book.local_grid = msg  # only now: one that is refused takes no tick's place
            self._answer_tick()

    def _read_local_grid(self, local_grid: OccupancyGrid | None) -> bool:
        """Read a neighbourhood; before there is a field its cells are all there is."""
        if local_grid is None:
            return False
        try:
            grid = self.supervisor.grid or cells_of_local_grid(local_grid)
            neighbourhood = neighbourhood_from_grid(local_grid, grid)
        except ValueError as error:
            self.supervisor.intake.refuse(str(error))
            self.supervisor.intake.local_grid.pass_over(time.monotonic(), str(error))
            return False
        self.supervisor.saw_neighbourhood(neighbourhood, time.monotonic(), grid)
        return True

    def _on_odometry(self, msg: Odometry) -> None:
        now, clock = time.monotonic(), self.get_clock().now().nanoseconds * 1e-9
        try:
            pose, grid = pose_from_odometry(msg), self.supervisor.grid
            if self._settings.lockstep and grid is not None:
                check_frame(pose.frame_id, grid.frame_id, 'odom', FRAME_OWNERS)
        except ValueError as error:
            if self._settings.lockstep and not self._book.is_newer(msg):
                self.supervisor.intake.refuse(str(error))  # of no tick that waits for an answer
                self.supervisor.intake.odometry.pass_over(now, str(error))
            else:
                self._stand(self.supervisor.saw_bad_input(str(error), now), msg)
            return
        if self._settings.lockstep:
            self._take_tick(msg, pose, now)
        elif not self.supervisor.intake.is_late_pose(pose, clock):
            self._book.odometry = msg
            self._publish(self.supervisor.saw_pose(pose, now, clock), msg)
        else:
            self.supervisor.intake.odometry.pass_over(now, self.supervisor.intake.why_late)

    def _take_tick(self, msg: Odometry, pose: Pose, now: float) -> None:
        """Lock-step: keep a pose until the neighbourhood of its stamp is there."""
        if self._book.is_answered(msg):
            return
        self._book.odometry = msg
        if self.supervisor.run is not None:
            self._answer_tick()
            return
        self.supervisor.saw_pose(pose, now)
        if self._book.owes_stop:
            self._writer.send(STANDSTILL, msg)

    def _answer_tick(self) -> None:
        """Lock-step: answer a tick, once, when both messages of it have come."""
        if (self._settings.lockstep and self.supervisor.run is not None
                and self._book.is_open()):
            odometry = self._book.odometry
            self._stand(self.supervisor.saw_pose(
                pose_from_odometry(odometry), time.monotonic()), odometry)

    def _stand(self, answer: Answer, odometry: Odometry) -> None:
        """Publish an answer; in lock-step a standstill where there is none, unless taken over."""
        supervisor = self.supervisor
        if self._settings.lockstep and answer.velocity is None and supervisor.run is not None and (
                supervisor.problem is not StopReason.TAKEN_OVER):
            answer = Answer(STANDSTILL, answer.rows)
        self._publish(answer, odometry)

    def _read_velocity(self, msg: Any) -> Velocity | None:
        try:
            return velocity_from_twist(msg)
        except ValueError as error:
            self.supervisor.intake.refuse(str(error))
            return None

    def _on_command(self, msg: Any) -> None:
        velocity = self._read_velocity(msg)
        if velocity is None or self._writer.is_own(msg, velocity):
            return
        if self.supervisor.run is not None and self._has_rival():
            self._publish(self.supervisor.saw_rival('another controller'))
        elif not self._why_old(msg, 'cmd_vel'):  # the base drops it, too: nobody drives by it
            self._publish(self.supervisor.saw_external(velocity, time.monotonic()))

    def _why_old(self, msg: Any, topic: str) -> str:
        """Say why a command was sent too long ago to be obeyed."""
        return self._ages.problem(
            msg, topic, self._settings, self.get_clock().now().nanoseconds * 1e-9,
            self._book.odometry, time.monotonic())

    def _on_teleop(self, msg: Any) -> None:
        velocity = self._read_velocity(msg)
        if velocity is None:
            return
        if why := self._why_old(msg, 'cmd_vel_teleop'):
            if self.supervisor.run is None:  # the person wonders why nothing moves
                self.supervisor.wheels.held = self.supervisor.held or why
                self._teleop_at = time.monotonic()
            return
        now = time.monotonic()
        # Whoever has stood for long begins gently.
        dt = min(now - self._writer.sent_at, 0.1 if self._teleop_at is None else 0.5)
        self._teleop_at = now
        answer = Answer()
        if not self._settings.lockstep or self._book.is_open():
            answer = self.supervisor.teleop(velocity, now, dt)
        if answer.velocity is not None or self.supervisor.run is None:
            self._out.request(velocity, self._time())
        self._publish(answer)

    def _on_contact(self, msg: Bool) -> None:
        if msg.data:
            self._publish(self.supervisor.saw_contact())

    def _on_goal(self, msg: PoseStamped) -> None:
        try:
            goal = pose_from_pose_stamped(msg)
            self.supervisor.saw_goal(goal.x, goal.y, goal.frame_id)
        except ValueError as error:
            self.supervisor.intake.refuse(str(error))

    def _on_start(self, _: Any, response: Any) -> Any:
        others = self._command_publishers.others if self._settings.exclusive_cmd_vel else []
        response.message = (
            f'{others[0]} publishes cmd_vel, too, and exclusive_cmd_vel is set' if others
            else self._peers.why_not(Operation.DRIVE)
            or self.supervisor.start(time.monotonic()))
        response.success = not response.message
        if response.success:
            response.message = self.supervisor.status.sentence
            self._book.owes_stop = False
            self._out.tell_trial()
            self._answer_tick()
        return response

    def _on_stop(self, _: Any, response: Any) -> Any:
        ran = self.supervisor.run is not None
        answer = self.supervisor.stop()
        self._publish(answer)
        response.success = ran or answer.velocity is not None
        response.message = 'no trial is running'
        if ran:
            response.message = self.supervisor.status.sentence
        elif response.success:
            response.message = 'the robot stands until the keys are let go'
        return response

    def _publish(self, answer: Answer, odometry: Odometry | None = None) -> None:
        self._out.publish(answer, odometry)

    def _watch(self) -> None:
        now = time.monotonic()
        self._publish(self.supervisor.watch(now))
        if self.supervisor.is_let_go(now):
            self._answer_tick()
        if self._teleop_at is not None and now - self._teleop_at > (
                self._settings.takeover_timeout):
            self._teleop_at = None
            self._end_teleop()
        self._look_for_new_publishers()
        if self.supervisor.held != self._told_held:  # a person wonders why nothing moves
            self._tell()

    def _guard(self) -> None:
        """Take the last command back if the robot must not follow it until the next pose."""
        self._threads.check()
        now, clock = time.monotonic(), self.get_clock().now().nanoseconds * 1e-9
        self.supervisor.wheels.punctuality.looks(
            now, time.thread_time(), drives(self.supervisor))
        self._publish(self.supervisor.guard(now, clock))
        if (outcome := self._fields.finished()) is not None:
            self._settle(outcome)
        self.supervisor.wheels.is_to_stand = is_busy = self._fields.is_busy
        self._publish(self.supervisor.reads_field(self._fields.is_reading))
        if is_busy and self._fields.is_asking and not drives(self.supervisor):
            self._fields.give_leave()

    def _end_teleop(self) -> None:
        """Stop the robot when a person lets go of the keys outside a trial."""
        if self.supervisor.let_go():
            self._publish(Answer(STANDSTILL))

    def _look_at_publishers(self) -> None:
        """Note who is on `cmd_vel`, and say once which parameter to set for another type."""
        news = self._command_publishers.look(self, self._writer.kind)
        if news:
            self._log('warning', news)
        if self._command_publishers.others and self._settings.exclusive_cmd_vel:
            self._publish(self.supervisor.saw_rival(self._command_publishers.others[0]))

    def _look_for_new_publishers(self) -> None:
        n = self.count_publishers(self.resolve_topic_name('cmd_vel'))
        if n != self._command_publishers.n_publishers:
            self._look_at_publishers()

    def _has_rival(self) -> bool:
        """Tell whether another controller is on `cmd_vel`."""
        self._look_for_new_publishers()
        return self._command_publishers.has_namesake(self.get_name())

    def _tell(self) -> None:
        self._look_at_publishers()
        self._told_held = self.supervisor.held
        self._out.tell(self._command_publishers, self._peers)

    def close(self) -> None:
        """Leave the robot standing, whatever has happened; then say how the trial ended."""
        with self._threads.lock:
            self._threads.mute()
            self._writer.send_now(STANDSTILL, self._book.odometry)
        patience = Duration(nanoseconds=200_000_000)
        self._out.commands.wait_for_all_acked(patience)
        self.supervisor.stop(StopReason.SHUTDOWN)
        self._out.tell_trial()
        self._out.trials.wait_for_all_acked(patience)
        self._threads.close()
        self._fields.close()


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
