"""The node `learner_node`: records, learns between trials, publishes the field."""

from collections.abc import Callable
from concurrent.futures import Future as JobFuture
from functools import partial
from operator import attrgetter
import os
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future
from sensor_msgs.msg import PointCloud2

from control_field.parameters import Parameters
from control_field.records import Outcome
from learner_node import effects as to
from learner_node.desk import Desk
from learner_node.frames import FrameCheck
from learner_node.lessons import Lesson
from learner_node.library import Library
from learner_node.phases import IN_TRIAL, Phase
from learner_node.publications import Publications
from learner_node.recorder import BagGoneError, Raw, Recorder, stamp_of
from learner_node.reports import (
    diagnostic_from_session, PROGRAM, sentence_at_start, sentence_from_lesson)
from learner_node.requests import Requests
from learner_node.session import Session
from learner_node.settings import FIXED, Settings, start_poses_from_list
from learner_node.topics import Recorded, recorded_topics, type_name
from learner_node.warm_up import warm_up
from learner_node.worker import result_of, Worker
from msgs_bridge import qos
from msgs_bridge.bag_folder import BagError, EpisodeKind, TaskFolder
from msgs_bridge.command_line import check_names
from msgs_bridge.complaints import Complaints
from msgs_bridge.node_main import exit_with, run_node
from msgs_bridge.parameters import declare_parameters_from
from msgs_bridge.poses import pose_from_odometry
from msgs_bridge.tables import decisions_from_cloud
from msgs_bridge.trial_status import State, status_from_trial, trial_from_status, TrialStatus

#: How often the session looks at the clock and at who is there, [s] of the wall clock.
_TICK_PERIOD: Final = 0.05
_PEERS_PERIOD: Final = 0.2
#: How often the bag is handed to the system, and the learner tells how it stands, [s].
_FLUSH_PERIOD: Final = 0.5
_TELL_PERIOD: Final = 1.0
#: How long the end waits for what is being learnt, [s].
_WORKER_PATIENCE: Final = 1.0
_START_POSES: Final = ParameterDescriptor(
    description='where trials start: x, y, yaw, x, y, yaw, ... [m, rad]', read_only=True)


class LearnerNode(Node):
    """
    The learner.

    Raises
    ------
    ValueError, rclpy.exceptions.ParameterException
        If a parameter or the bags folder is wrong: one line that names it.

    """

    def __init__(self, **options: Any) -> None:
        """Declare, subscribe, and begin to learn what the bags hold."""
        super().__init__('learner_node', **options)
        parameters = declare_parameters_from(
            self, Parameters, fixed=list(Parameters.__dataclass_fields__))
        self._settings = declare_parameters_from(
            self, Settings, fixed=FIXED, on_change=self._on_settings)
        poses = self.declare_parameter(
            'start_poses', Parameter.Type.DOUBLE_ARRAY, _START_POSES).value
        check_names(self)
        task = TaskFolder(self._settings.bags, self._settings.task)
        grid = self._settings.grid
        starts = start_poses_from_list(poses, grid)
        task.hold()
        self._library = Library(task, grid, parameters, starts, self._settings.fresh)
        if self._library.aside:
            task.hold()
        self._session = Session(
            self._settings, lambda: self._library.next_start(self._settings.starts == 'spread'))
        self._recorder = Recorder(self._library.task, self._library.header)
        self.fatal = ''
        self.has_ended = False  #: whether the worker is done, too; nothing is lost if it is not
        self._lesson: Lesson | None = None
        self._heard: set[str] = set()
        self._frame_check = FrameCheck(self._settings.frame_id, self._say)
        self._complaints, self._odometry_time = Complaints(self), 0
        self._told: tuple[object, ...] = ()
        self.said = ''  #: what people were told last
        self._make_topics()
        self._make_services()
        self._worker = Worker()
        self._worker.wake = self.create_guard_condition(self._worker.collect).trigger
        self._worker.do(self._library.relearn, self._on_relearnt)
        self._worker.do(lambda: warm_up(parameters), self._on_warm)
        self._session.begin(time.monotonic())

    def _make_topics(self) -> None:
        self._publications = Publications(self, self._settings.frame_id)
        topics = recorded_topics(self._settings)
        self._library.topics = {t.name: self.resolve_topic_name(t.name) for t in topics}
        for topic in topics:
            qos.hear_all(self, topic.kind, topic.name, self._reader(topic), topic.profiles,
                         raw=True)

    def _make_services(self) -> None:
        self._desk = Desk(self, self._session, lambda: Future(executor=self.executor),
                          MutuallyExclusiveCallbackGroup())
        self._requests = Requests(self, self._settings.controller)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_TICK_PERIOD, self._tick, clock=steady)
        self.create_timer(_PEERS_PERIOD, self._look_at_peers, clock=steady)
        self.create_timer(_FLUSH_PERIOD, lambda: self._guard(self._recorder.flush), clock=steady)
        self.create_timer(_TELL_PERIOD, self._tell, clock=steady)

    def _on_settings(self, settings: Settings) -> None:
        self._settings = self._session.settings = settings

    # What comes in

    def _reader(self, topic: Recorded) -> Any:
        """Return the callback of a topic: record what arrives, and look at it where it matters."""
        name, kind = self.resolve_topic_name(topic.name), topic.type_name
        looks = {'odom': self._saw_odometry, 'experience': self._saw_experience,
                 'trial': self._saw_trial,
                 'neighbourhood': lambda cdr: self.carry_out(
                     self._session.saw_sight(stamp_of(cdr) * 1e-9, time.monotonic())),
                 'cmd_vel': lambda _: self._session.heard_command(time.monotonic())}
        look = looks.get(topic.name, lambda _: None)

        def read(cdr: bytes) -> None:
            message = Raw(name, kind, cdr, self._now(topic.name, cdr))
            self._heard.add(topic.name)
            self._guard(lambda: self._recorder.saw(topic.name, message))
            look(cdr)

        return read

    def _now(self, topic: str, cdr: bytes) -> int:
        """Return the time of arrival, [ns]; in lock-step the simulator's."""
        if topic == 'odom':
            self._odometry_time = stamp_of(cdr)
        return self._odometry_time if self._settings.lockstep else int(
            self.get_clock().now().nanoseconds)

    def _saw_odometry(self, cdr: bytes) -> None:
        self.carry_out(self._session.heard_odometry(
            self._odometry_time * 1e-9, time.monotonic()))
        if self._frame_check.is_due:
            self._read(self._frame_check.saw, Odometry, cdr)
        if self._session.phase is Phase.PLACING:
            pose = self._read(pose_from_odometry, Odometry, cdr)
            if pose is not None:
                self.carry_out(self._session.saw_pose(
                    pose.x, pose.y, pose.yaw, time.monotonic()))

    def _saw_experience(self, cdr: bytes) -> None:
        rows = self._read(
            partial(decisions_from_cloud, grid=self._library.grid), PointCloud2, cdr)
        if rows is not None and len(rows):
            self.carry_out(self._session.saw_decisions(
                int(rows['trial'][0]), len(rows), time.monotonic()))

    def _saw_trial(self, cdr: bytes) -> None:
        status = self._read(trial_from_status, DiagnosticStatus, cdr)
        if status is not None:
            self.carry_out(self._session.saw_status(status, time.monotonic()))

    def _read(self, reader: Callable[[Any], Any], kind: Any, cdr: bytes) -> Any:
        """Return what a message says; None, and a warning, if it is not to be trusted."""
        try:
            return reader(deserialize_message(cdr, kind))
        except (ValueError, RuntimeError) as error:
            self._complaints.refused(error, kind)
            return None

    # Time alone

    def _tick(self) -> None:
        self._requests.send()
        self.carry_out(self._session.tick(time.monotonic()))
        told = (self._session.phase, self._session.n_left, self._session.revision,
                len(self._heard))
        if told != self._told:
            self._told = told
            self._tell()

    def _look_at_peers(self) -> None:
        self.carry_out(self._session.saw_peers(self._requests.peers(), time.monotonic()))

    def _tell(self) -> None:
        self._publications.tell(diagnostic_from_session(
            self.get_fully_qualified_name(), self._session, self._lesson, self._library.refresh,
            self._heard), self.get_clock().now().to_msg())

    # What the session wants done

    def carry_out(self, effects: to.Effects) -> None:
        """Do what the session wants done, in order."""
        for effect in effects:
            if not self._guard(partial(self._do, effect)):
                return

    def _guard(self, work: Callable[[], Any]) -> bool:
        """Do what fails when nothing can be recorded any more; tell whether it succeeded."""
        try:
            work()
        except BagError as error:
            self._lose(error)
            return False
        return True

    def _do(self, effect: to.Effect) -> None:
        match effect:
            case to.Record(kind):
                self._record(kind)
            case to.Close():
                self._close_and_learn()
            case to.Abandon(reason, trial):
                self._abandon(reason, trial)
            case to.Discard():
                self._recorder.discard()
            case to.Place(pose):
                self._publications.place(pose, self._odometry_time * 1e-9)
            case to.StartTrial():
                self._requests.start(self._on_answer)
            case to.StopTrial():
                self._requests.stop()
            case to.Say(text, warns):
                self._say(text, warns)

    def _record(self, kind: EpisodeKind) -> None:
        episode = self._recorder.start(kind, self._now(topic='', cdr=b''))
        if kind is EpisodeKind.DEMO:
            self._frame_check.is_due = True
            self._write_status(State.RUNNING, 0)
        self._say(f'recording {episode.name}')

    def _close_and_learn(self) -> None:
        if self._recorder.kind is EpisodeKind.DEMO:
            self._write_status(State.ENDED, 0, Outcome.GOAL, 'the demonstration was kept')
        episode = self._recorder.close()
        if episode is not None:
            self._worker.do(lambda: self._library.learn(episode), self._on_lesson)

    def _abandon(self, reason: str, trial: int) -> None:
        if reason and self._recorder.kind is not None:
            self._write_status(State.ENDED, trial, Outcome.ABORTED, reason)
        self._recorder.close()

    def _on_answer(self, accepted: bool, message: str) -> None:
        self.carry_out(self._session.start_answered(accepted, message, time.monotonic()))

    def _say(self, text: str, warns: bool = False) -> None:
        self.said = text
        if warns:
            self.get_logger().warning(text)
        else:
            self.get_logger().info(text)

    def _lose(self, error: BagError) -> None:
        """Nothing can be recorded any more: say so once, stop the robot, keep what there is."""
        kept = '' if isinstance(error, BagGoneError) else ', what was recorded is kept'
        self.get_logger().error(f'{error}; the robot is stopped{kept}')
        self.said = str(error)
        self._desk.answer(False, str(error))
        self.carry_out(self._session.failed(str(error), time.monotonic()))

    def _write_status(
        self, state: State, trial: int, outcome: Outcome | None = None, reason: str = '',
    ) -> None:
        """Write into the bag how the episode stands, as the learner sees it."""
        status = TrialStatus(state, trial, outcome, reason, stamp=self._odometry_time * 1e-9)
        self._recorder.write(self._raw('trial', status_from_trial(status, self._settings.task)))

    def _raw(self, topic: str, message: Any) -> Raw:
        """Return a message of our own as a recorder would have got it."""
        return Raw(self.resolve_topic_name(topic), type_name(type(message)),
                   bytes(serialize_message(message)), self._now(topic='', cdr=b''))

    def change_trials(self, change: Callable[[float], to.Effects], now: float) -> to.Effects:
        """Begin or stop trials; those from chosen starts drive on a field of their own."""
        effects = change(now)
        if self._settings.starts == 'spread' and self._session.phase not in IN_TRIAL:
            self._publish_field(self._session.n_left > 0)
        return effects

    # What was learnt

    def relearn_after(self, change: str, *arguments: Any) -> None:
        """Let the library change a bag, and learn from all of them anew."""
        self._worker.do(partial(getattr(self._library, change), *arguments), self._on_changed)

    def _on_changed(self, future: 'JobFuture[str]') -> None:
        try:
            text = self._result(future)
        except BagError as error:
            self._go_on()
            self._desk.answer(False, str(error))
            return
        self._learnt()
        self._say(text)
        self._desk.answer(True, text)

    def _on_relearnt(self, future: 'JobFuture[list[str]]') -> None:
        try:
            for line in self._result(future):
                self._say(line)
            for line in self._library.doubts:
                self._say(line, warns=True)
        except BagError as error:
            self.fatal = str(error)
            return
        self._say(sentence_at_start(self._settings, self._library.task, self._library.refresh))
        self._learnt()

    def _on_lesson(self, future: 'JobFuture[Lesson]') -> None:
        try:
            self._lesson = self._result(future)
        except BagError as error:
            self._lose(error)
            return
        self._learnt()
        sentence = sentence_from_lesson(self._lesson)
        self._say(sentence)
        self._desk.answer(self._lesson.refresh is not None, sentence)

    def _on_warm(self, future: 'JobFuture[None]') -> None:
        try:
            self._result(future)
        except BagError as error:
            self._say(str(error), warns=True)

    def _result(self, future: 'JobFuture[Any]') -> Any:
        return result_of(future, self.get_logger().error)

    def _learnt(self) -> None:
        """Push the field, then let the session go on with it."""
        self._publish_field(self._session.n_left > 1)
        self._go_on()

    def _go_on(self) -> None:
        refresh = self._library.refresh
        self.carry_out(self._session.learnt(
            -1 if refresh is None else refresh.field.revision, time.monotonic()))
        missing = self._settings.auto_trials - self._library.n_trials
        if (self._settings.auto_start and missing > 0 and refresh is not None
                and self._session.phase is Phase.IDLE):
            self.carry_out(self.change_trials(
                partial(self._session.run_trials, missing), time.monotonic()))

    def _publish_field(self, more_trials: bool = False) -> None:
        refresh = self._library.refresh
        if refresh is None:
            # A controller may still hold the field of bags that are gone, or of another task.
            self._publications.publish_nothing(self._library.grid)
            self._recorder.in_force = []
            return
        field = self._library.field(more_trials and self._settings.starts == 'spread')
        messages = self._publications.publish_field(field, refresh)
        self._recorder.in_force = [self._raw(*message) for message in messages.items()]

    def close(self) -> None:
        """End what is under way: the trial is stopped, the bag closed and marked as aborted."""
        self.carry_out(self._session.shut_down(time.monotonic()))
        self.has_ended = self._worker.close(_WORKER_PATIENCE)


def main(args: list[str] | None = None) -> None:
    """
    Run the node until SIGINT or SIGTERM; the open bag is closed before it ends.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument, a parameter or the bags folder is
        wrong.

    """
    node = run_node(PROGRAM, LearnerNode, args, is_over=attrgetter('fatal'))
    if node is not None and node.fatal:
        exit_with('learner_node', node.fatal)
    if node is not None and not node.has_ended:
        # Compiling may take seconds yet, and a thread in it does not survive the interpreter.
        os._exit(0)


if __name__ == '__main__':
    main()
