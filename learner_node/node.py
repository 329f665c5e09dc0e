"""The node `learner_node`: records, learns between trials, publishes the field."""

from collections.abc import Callable
from concurrent.futures import Future as JobFuture
from functools import partial
from operator import attrgetter
import os
import time
from typing import Any, Final

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import Empty

from control_field.parameters import Parameters
from episode_store.episode import Episode
from episode_store.gaps import BagGaps, note_gaps
from episode_store.relearn import LearntBag
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder, EpisodeKind, TaskFolder
from learner_node.background_worker import BackgroundWorker, result_of
from learner_node.field_monitor import FieldMonitor
from learner_node.kernel_warm_up import warm_up_kernels
from learner_node.message_dispatcher import MessageDispatcher
from learner_node.message_queue import RawMessage
from learner_node.odometry_check import OdometryCheck
from learner_node.output_handler import OutputHandler
from learner_node.outputs import Outputs
from learner_node.phases import IN_TRIAL, Phase
from learner_node.publications import Publications
from learner_node.recorder import Recorder, stamp_of
from learner_node.reports import (
    diagnostic_from_session, NEXT, numbers_from_learnt_bag, PROGRAM, sentence_at_start,
    sentence_from_learnt_bag)
from learner_node.requests import Requests
from learner_node.services import LearnerServices
from learner_node.session import Session
from learner_node.settings import FIXED, Settings, start_poses_from_list
from learner_node.task_memory import TaskMemory
from learner_node.topics import Recorded, recorded_topics
from msgs_bridge.node import qos
from msgs_bridge.node.command_line import check_names
from msgs_bridge.node.listener import Listener
from msgs_bridge.node.node_info import method_from_parameters, Operation, workspace_from_grid
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.node.ros_parameters import declare_parameters_from
from msgs_bridge.node.run import exit_with, run_node
from msgs_bridge.node.throttled_log import ThrottledLog

#: How often the session looks at the clock and at who is there, [s] of the wall clock.
_TICK_PERIOD: Final = 0.05
_PEERS_PERIOD: Final = 0.2
#: How often the bag is handed to the system, and the learner tells how it stands, [s].
_FLUSH_PERIOD: Final = 0.5
_TELL_PERIOD: Final = 1.0
#: So many messages are looked at before others have their turn.
_BATCH: Final = 100
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
        if not self._settings.new_task:
            task.check_is_meant()
        task.hold()
        self._task_memory = TaskMemory(task, grid, parameters, starts, self._settings.fresh)
        self._task_memory.speed_max = self._settings.speed_max
        self._session = Session(
            self._settings,
            lambda: self._task_memory.next_start(self._settings.starts == 'spread'))
        self._recorder = Recorder(self._task_memory.task, self._task_memory.header)
        self.fatal = ''
        self.has_ended = False  #: whether the worker is done, too; nothing is lost if it is not
        self._learnt_bag: LearntBag | None = None
        self._told: tuple[object, ...] = ()
        self.said = ''  #: what people were told last
        self._named: dict[str, str] = {}
        self._peers, self._field_monitor = PeerMonitor(self, 'learner'), FieldMonitor()
        self._peers.describe(workspace_from_grid(grid), method_from_parameters(parameters))
        self._session.state.why_not = self._peers.why_not
        self._make_topics()
        self._make_services()
        self._worker = BackgroundWorker()
        self._worker.wake = self.create_guard_condition(self._worker.collect).trigger
        self._worker.do(self._task_memory.relearn, self._on_relearnt)
        self._worker.do(lambda: warm_up_kernels(parameters), self._on_warm)
        self._session.begin(time.monotonic())
        self._listener.start()

    def _make_topics(self) -> None:
        self._publications = Publications(self, self._settings.frame_id)
        self._requests = Requests(self, self._settings.controller)
        self._handler = OutputHandler(self, self._recorder, self._publications, self._requests)
        self._dispatcher = MessageDispatcher(
            self._session, self._task_memory.grid, self._handler.carry_out,
            OdometryCheck(self._task_memory.grid), ThrottledLog(self))
        topics = recorded_topics(self._settings)
        self._task_memory.topics = {t.name: self.resolve_topic_name(t.name) for t in topics}
        teacher = self._session.demonstration.teacher
        self.create_subscription(
            Empty, 'teleop_heartbeat',
            lambda _: teacher.on_heartbeat(time.monotonic()), qos.SENSOR)
        self._wake = self.create_guard_condition(self._collect).trigger
        self._newest = 0  #: stamp of the newest odometry that the listener has heard, [ns]
        self._listener = Listener(self, self._recorder.lost, self._recorder.catch_up)
        for topic in topics:
            self._listener.subscribe(topic.kind, self._task_memory.topics[topic.name],
                                self._reader(topic), topic.profiles, topic.spare, topic.kept)

    def _make_services(self) -> None:
        self._learner_services = LearnerServices(
            self, self._session, self._handler.carry_out,
            lambda: Future(executor=self.executor), MutuallyExclusiveCallbackGroup())
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_TICK_PERIOD, self._tick, clock=steady)
        self.create_timer(_PEERS_PERIOD, self._look_at_peers, clock=steady)
        self.create_timer(_FLUSH_PERIOD, partial(self._handler.guard, self._recorder.flush),
                          clock=steady)
        self.create_timer(_TELL_PERIOD, self.tell, clock=steady)
        self.create_timer(_TELL_PERIOD, self._look_at_field, clock=steady)

    def _on_settings(self, settings: Settings) -> None:
        self._settings = self._session.state.settings = settings

    # What comes in

    def _reader(self, topic: Recorded) -> Callable[[bytes, int], None]:
        """Return the callback of a topic, which runs in the thread of the listener."""
        name, kind = self.resolve_topic_name(topic.name), topic.type_name

        def read(cdr: bytes, arrived: int) -> None:
            if topic.name == 'odom':
                self._newest = stamp_of(cdr)
            stamp = self._newest if self._settings.lockstep else arrived
            self._recorder.arrived(topic.name, RawMessage(name, kind, cdr, stamp))
            self._wake()

        return read

    def _collect(self) -> None:
        """Record what has arrived and hand it to the session, in order."""
        for _ in range(_BATCH):
            arrival = self._recorder.oldest()
            if arrival is None:
                return
            self._handler.guard(self._recorder.take)
            self._dispatcher.dispatch(arrival.name, arrival.message.cdr)
        self._wake()

    @property
    def odometry_time(self) -> int:
        """Return the stamp of the newest odometry, [ns]."""
        return self._dispatcher.odometry_time

    def now(self) -> int:
        """Return the time, [ns]; in lock-step the simulator's."""
        return self.odometry_time if self._settings.lockstep else int(
            self.get_clock().now().nanoseconds)

    # Time alone

    def _tick(self) -> None:
        self._requests.send()
        self._collect()
        self._handler.carry_out(self._session.tick(time.monotonic()))
        state = self._session.state
        told = (state.phase, self._session.series.n_left, state.revision,
                len(self._dispatcher.topics_heard))
        if told != self._told:
            self._told = told
            self.tell()

    def _look_at_peers(self) -> None:
        self._handler.carry_out(self._session.on_peers(self._requests.peers(), time.monotonic()))

    def _look_at_field(self) -> None:
        """Publish the field once more if another learner's has taken its place."""
        state = self._session.state
        self._field_monitor.look(state.inputs.status, state.revision, state.memory,
                                 not self._peers.why_not(Operation.CHANGE))
        if self._field_monitor.must_publish:
            self.say('the controller has another control field than the one learnt here (was a '
                     'second learner there?): it is given this one again', warns=True)
            self._publish_field(self._session.series.n_left > 0)

    def tell(self) -> None:
        """Publish the status of the learner."""
        self._name_trial()
        more = {**self._task_memory.places, **self._named,
                'refused': str(self._dispatcher.n_refused)}
        status = diagnostic_from_session(
            self.get_fully_qualified_name(), self._session, self._learnt_bag,
            self._task_memory.refresh, self._dispatcher.topics_heard, more)
        self._peers.add_to(status)
        self._publications.tell(status, self.get_clock().now().to_msg())

    def _name_trial(self) -> None:
        """Log in which bag the controller's trial is recorded: people look for it there."""
        named = {'trial': str(self._session.state.trial), 'bag': self._handler.bag}
        if self._session.state.trial and named != self._named:
            self._named = named
            self.get_logger().info(f'trial {self._session.state.trial} is {self._handler.bag}')

    # What others ask of the node

    def say(self, text: str, warns: bool = False) -> None:
        """Log a sentence for people, and keep it for answers."""
        self.said = text
        if warns:
            self.get_logger().warning(text)
        else:
            self.get_logger().info(text)

    def failed(self, why: str, text: str) -> None:
        """Report, also to a request that waits, that nothing can be recorded any more."""
        self.get_logger().error(text)
        self.said = why
        self._learner_services.answer(False, why)
        self._handler.carry_out(self._session.on_recording_failed(why, time.monotonic()))

    def on_answer(self, accepted: bool, message: str) -> None:
        """Go on with the controller's answer to a request to start."""
        self._handler.carry_out(
            self._session.on_start_response(accepted, message, time.monotonic()))

    def learn(self, episode: EpisodeFolder) -> None:
        """Learn from a bag that was recorded."""
        self._name_trial()
        self._worker.do(lambda: self._task_memory.learn(episode), self._on_learnt_bag)

    def note_gaps(self, episode: EpisodeFolder) -> None:
        """Note the gaps in a bag that is not learnt from."""
        self._worker.do(lambda: note_gaps(Episode(episode)), self._on_noted)

    def change_trials(self, change: Callable[[float], Outputs], now: float) -> Outputs:
        """Begin or stop trials; those from spread starts need a field of their own."""
        outputs = change(now)
        if self._settings.starts == 'spread' and self._session.state.phase not in IN_TRIAL:
            self._publish_field(self._session.series.n_left > 0)
        return outputs

    # What was learnt

    def relearn_after(self, change: str, *arguments: Any) -> None:
        """Change the bags of the task, and relearn from all of them."""
        self._worker.do(partial(getattr(self._task_memory, change), *arguments), self._on_changed)

    def _on_changed(self, future: 'JobFuture[str]') -> None:
        try:
            text = result_of(future, self.get_logger().error)
        except BagError as error:
            self._go_on()
            self._learner_services.answer(False, str(error))
            return
        self._learnt()
        self.say(text)
        self._learner_services.answer(True, text)

    def _on_relearnt(self, future: 'JobFuture[list[str]]') -> None:
        try:
            for line in result_of(future, self.get_logger().error):
                self.say(line)
            for line in self._task_memory.doubts:
                self.say(line, warns=True)
        except BagError as error:
            self.fatal = str(error)
            return
        self.say(sentence_at_start(
            self._settings, self._task_memory.task, self._task_memory.refresh))
        self._learnt()

    def _on_learnt_bag(self, future: 'JobFuture[LearntBag]') -> None:
        try:
            self._learnt_bag = result_of(future, self.get_logger().error)
        except BagError as error:
            self._handler.lose(error)
            return
        self._learnt()
        sentence = sentence_from_learnt_bag(self._learnt_bag)
        is_demo = self._learnt_bag.folder.kind is EpisodeKind.DEMO
        is_learnt = self._learnt_bag.refresh is not None
        if is_demo and is_learnt:
            sentence += f' {NEXT}'
        self.say(sentence, warns=is_demo and not is_learnt)
        if numbers := numbers_from_learnt_bag(self._learnt_bag):
            self.get_logger().info(f'in numbers: {numbers}')
        self._learner_services.answer(is_learnt, sentence)

    def _on_noted(self, future: 'JobFuture[BagGaps]') -> None:
        try:
            gaps = result_of(future, self.get_logger().error)
        except BagError as error:
            self.say(str(error), warns=True)
            return
        if gaps:
            self.say(str(gaps), warns=True)

    def _on_warm(self, future: 'JobFuture[None]') -> None:
        try:
            result_of(future, self.get_logger().error)
        except BagError as error:
            self.say(str(error), warns=True)

    def _learnt(self) -> None:
        """Publish the field, then let the session go on with it."""
        self._publish_field(self._session.series.n_left > 1)
        self._go_on()
        # Aside, after what somebody waits for.
        self._worker.do(self._task_memory.find_places, self._on_warm)

    def _go_on(self) -> None:
        refresh = self._task_memory.refresh
        self._handler.carry_out(self._session.on_learnt(
            -1 if refresh is None else refresh.field.revision, time.monotonic(),
            self._task_memory.memory))
        missing = self._settings.auto_trials - self._task_memory.n_trials
        series, is_idle = self._session.series, self._session.state.phase is Phase.IDLE
        if (self._settings.auto_start and missing > 0 and refresh is not None and is_idle
                and not series.is_stopped):
            self._handler.carry_out(
                self.change_trials(partial(series.begin, missing), time.monotonic()))

    def _publish_field(self, more_trials: bool = False) -> None:
        refresh = self._task_memory.refresh
        if refresh is None:
            # A controller may still hold the field of bags that are gone, or of another task.
            self._publications.publish_nothing(self._task_memory.grid)
            self._recorder.latched = []
            return
        field = self._task_memory.field(more_trials and self._settings.starts == 'spread')
        messages = self._publications.publish_field(field, refresh, self._task_memory.memory)
        self._recorder.latched = [self._handler.raw(*message) for message in messages.items()]

    def close(self) -> None:
        """End what is under way: the trial is stopped, the bag closed and marked as aborted."""
        self._listener.close()
        while self._recorder.oldest() is not None:
            self._collect()
        self._handler.carry_out(self._session.shut_down(time.monotonic()))
        self.has_ended = self._worker.close(_WORKER_PATIENCE)

    def destroy_node(self) -> None:
        """Close the thread that listens, too."""
        self._listener.close()
        super().destroy_node()


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
