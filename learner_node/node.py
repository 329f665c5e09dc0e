"""The node `learner_node`: records, learns between trials, publishes the field."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from operator import attrgetter
import os
import time
from typing import Any, Final

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import Empty

from control_field.parameters import Parameters
from episode_store.task_folder import EpisodeFolder, TaskFolder
from learner_node.learning.learning_loop import LearningLoop
from learner_node.learning.task_memory import TaskMemory
from learner_node.output_handler import OutputHandler
from learner_node.publications import Publications
from learner_node.recording.cells_check import CellsCheck
from learner_node.recording.message_dispatcher import MessageDispatcher
from learner_node.recording.message_queue import RawMessage
from learner_node.recording.odometry_check import OdometryCheck
from learner_node.recording.recorder import Recorder, stamp_of
from learner_node.recording.topics import Recorded, recorded_topics
from learner_node.reports import diagnostic_from_session, PROGRAM
from learner_node.requests import Requests
from learner_node.services import LearnerServices
from learner_node.session.field_monitor import FieldMonitor
from learner_node.session.inputs import is_running
from learner_node.session.phases import Phase
from learner_node.session.room_watch import RoomWatch
from learner_node.session.session import Session
from learner_node.settings import FIXED, Settings, start_poses_from_list
from learner_node.task_change import TaskChange
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
#: How often is looked where the robot stands, [s].
_PLACE_PERIOD: Final = 0.5
#: So many messages are looked at before others have their turn.
_BATCH: Final = 100
#: How long the end waits for what is being learnt, [s].
_WORKER_PATIENCE: Final = 1.0
_START_POSES: Final = ParameterDescriptor(
    description='where trials start: x, y, yaw, x, y, yaw, ... [m, rad]', read_only=True)


class LearnerNode(Node):
    """
    The learner.

    Setting `task` while nothing is under way lets it go on with another task, whose bags it
    learns from first; if that fails it stays at the one it had.

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
        self._method = parameters
        self._starts = start_poses_from_list(poses, self._settings.grid)
        if not self._settings.new_task:
            task.check_is_meant()
        task.hold()
        self._topics = recorded_topics(self._settings)
        self._task_memory = self._memory_of(task, self._settings.fresh)
        self._session = Session(
            self._settings,
            lambda: self._task_memory.next_start(self._settings.starts == 'spread'))
        self._recorder = Recorder(self._task_memory.task, self._task_memory.header)
        self.has_ended = False  #: whether the worker is done, too; nothing is lost if it is not
        self._told: tuple[object, ...] = ()
        self.said = ''  #: what people were told last
        self._peers, self._field_monitor = PeerMonitor(self, 'learner'), FieldMonitor()
        self._look_after(self._task_memory)
        self.describe()
        self._session.state.why_not = self._why_not
        self._make_topics()
        self._make_services()
        self._task_change = TaskChange(self, self._session, self.learning, self._memory_of)
        self.learning.begin(parameters, time.monotonic())
        self._listener.start()

    def _memory_of(self, task: TaskFolder, fresh: bool = False) -> TaskMemory:
        """Return the memory of a task; nothing of it is learnt from yet."""
        settings = self._settings
        memory = TaskMemory(task, settings.grid, self._method, self._starts, fresh)
        memory.speed_max, memory.resolution = settings.speed_max, settings.resolution
        memory.topics = {each.name: self.resolve_topic_name(each.name) for each in self._topics}
        memory.robot = lambda: self._dispatcher.place
        memory.lattice = lambda: self._cells.lattice(self._dispatcher.local_grid)
        return memory

    def enter(self, memory: TaskMemory) -> None:
        """Be at another task from now on."""
        self._task_memory.task.release()
        self._task_memory = memory
        self._settings = self._session.state.settings = replace(
            self._settings, task=memory.task.task)
        self._recorder.change_task(memory.task, memory.header)
        self._handler.bag = ''
        self._look_after(memory)

    def stay(self) -> None:
        """Let the parameter `task` be again what the learner is at."""
        self.set_parameters([Parameter('task', value=self._task_memory.task.task)])

    def _look_after(self, memory: TaskMemory) -> None:
        self._named: dict[str, str] = {}
        self._room_watch = RoomWatch(memory.has_room)
        self._cells = CellsCheck(
            self._settings, partial(self._peers.cells, 'sight', 'robot'))

    def _make_topics(self) -> None:
        self._publications = Publications(self, self._settings.frame_id)
        self._requests = Requests(self, self._settings.controller)
        self._handler = OutputHandler(self, self._recorder, self._publications, self._requests)
        self.learning = LearningLoop(
            self, self._session, self._task_memory, self._publications, self._handler)
        self._dispatcher = MessageDispatcher(
            self._session, self._settings.grid, self._handler.carry_out,
            OdometryCheck(self._settings.frame_id, self._settings.grid), ThrottledLog(self))
        teacher = self._session.demonstration.teacher
        self.create_subscription(
            Empty, 'teleop_heartbeat',
            lambda _: teacher.on_heartbeat(time.monotonic()), qos.SENSOR)
        self._wake = self.create_guard_condition(self._collect).trigger
        self._newest = 0  #: stamp of the newest odometry that the listener has heard, [ns]
        self._listener = Listener(self, self._recorder.lost, self._recorder.catch_up)
        for topic in self._topics:
            self._listener.subscribe(topic.kind, self._task_memory.topics[topic.name],
                                self._reader(topic), topic.profiles, topic.spare, topic.kept)
        self._session.state.has_heard_all = self._has_heard_all

    def _make_services(self) -> None:
        self.learner_services = LearnerServices(
            self, self._session, self.learning, self._handler.carry_out, self._collect_all,
            lambda: Future(executor=self.executor), MutuallyExclusiveCallbackGroup(),
            ReentrantCallbackGroup())
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_TICK_PERIOD, self._tick, clock=steady)
        self.create_timer(_PEERS_PERIOD, self._look_at_peers, clock=steady)
        self.create_timer(_FLUSH_PERIOD, partial(self._handler.guard, self._recorder.flush),
                          clock=steady)
        self.create_timer(_TELL_PERIOD, self.tell, clock=steady)
        self.create_timer(_TELL_PERIOD, self._look_at_field, clock=steady)
        if self._settings.grid is None:
            self.create_timer(_PLACE_PERIOD, self._look_at_place, clock=steady)

    def _on_settings(self, settings: Settings) -> None:
        task = self._task_memory.task.task
        self._settings = self._session.state.settings = replace(settings, task=task)
        if settings.task != task:
            self._task_change.begin(settings.task)

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
            if not self._collect_one(time.monotonic()):
                return
        self._wake()

    def _collect_all(self) -> None:
        """Record and hand on what arrived before now, however much that is."""
        now = time.monotonic()
        while self._collect_one(now):
            pass

    def _collect_one(self, now: float) -> bool:
        """Record and hand on the oldest message; return False if none came before a time."""
        arrival = self._recorder.oldest()
        if arrival is None or arrival.since > now:
            return False
        self._handler.guard(self._recorder.take)
        self._dispatcher.dispatch(arrival.name, arrival.message.cdr)
        return True

    def _has_heard_all(self, since: float) -> bool:
        """Return True once what the middleware had at a time, [s], was recorded and handed on."""
        caught_up, arrival = self._listener.caught_up(since), self._recorder.oldest()
        return caught_up is not None and (arrival is None or arrival.since > caught_up)

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
            self.learning.publish_field(self._session.series.n_left > 0)

    def _look_at_place(self) -> None:
        """Let the field grow to where the robot stands, before a person starts a trial there."""
        state = self._session.state
        is_free = state.phase is Phase.IDLE and not is_running(state.inputs.status)
        if self._room_watch.look(self._dispatcher.place, is_free):
            self.learning.make_room()

    def _why_not(self, operation: Operation) -> str:
        """Return why an operation must not be done now; empty if it may."""
        problem = self._peers.why_not(operation)
        if problem or operation is not Operation.TEACH or self._settings.grid is not None:
            return problem
        heard, learnt = self._dispatcher.local_grid, self._task_memory.learnt_grid
        topic = self.resolve_topic_name('neighbourhood')
        if not heard and learnt is None and self.count_publishers(topic):
            return (f'nothing has arrived on {topic} yet, whose cells it is to have: wait a '
                    f'moment, or see what its publisher says')
        return self._cells.problem(heard, learnt)

    def describe(self) -> None:
        """Tell the peers the workspace and the parameters of the method."""
        grid, is_fitted = self._task_memory.learnt_grid, self._settings.grid is None
        self._peers.describe(None if grid is None else workspace_from_grid(grid, is_fitted),
                             method_from_parameters(self._task_memory.relearner.parameters))

    def tell(self) -> None:
        """Publish the status of the learner."""
        self._name_trial()
        more = {**self._task_memory.places, **self._named, **self._task_memory.counts(),
                'simulation': str(self._settings.simulation).lower(),
                'ended': self._session.demonstration.ended_code,
                'refused': str(self._dispatcher.n_refused)}
        status = diagnostic_from_session(
            self.get_fully_qualified_name(), self._session, self.learning.newest,
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
        self.learner_services.answer(False, why, 'disk')
        self._handler.carry_out(self._session.on_recording_failed(why, time.monotonic()))

    def on_answer(self, accepted: bool, message: str) -> None:
        """Go on with the controller's answer to a request to start."""
        self._handler.carry_out(
            self._session.on_start_response(accepted, message, time.monotonic()))

    def on_stop_answer(self, accepted: bool, message: str) -> None:
        """Note the controller's answer to a request to stop."""
        self._session.state.unheard_stop.on_answer(message)

    def learn(self, episode: EpisodeFolder) -> None:
        """Learn from a bag that was recorded."""
        self._name_trial()
        self.learning.learn(episode)

    def close(self) -> None:
        """End what is under way: the trial is stopped, the bag closed and marked as aborted."""
        self._listener.close()
        while self._recorder.oldest() is not None:
            self._collect()
        self._handler.carry_out(self._session.shut_down(time.monotonic()))
        self.has_ended = self.learning.worker.close(_WORKER_PATIENCE)

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
    node = run_node(PROGRAM, LearnerNode, args, is_over=attrgetter('learning.fatal'))
    if node is not None and node.learning.fatal:
        exit_with('learner_node', node.learning.fatal)
    if node is not None and not node.has_ended:
        # Compiling may take seconds yet, and a thread in it does not survive the interpreter.
        os._exit(0)


if __name__ == '__main__':
    main()
