"""From bags to the published field: learning in the background, and what follows from it."""

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
import time
from typing import Any, Final

from control_field.grid import TooLargeError
from control_field.parameters import Parameters
from episode_store.episode import Episode
from episode_store.errors import NothingThereError
from episode_store.gaps import BagGaps, note_gaps
from episode_store.relearn import LearntBag
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder, EpisodeKind
from learner_node.learning.background_worker import BackgroundWorker, result_of
from learner_node.learning.kernel_warm_up import warm_up_kernels
from learner_node.learning.task_memory import TaskMemory
from learner_node.output_handler import OutputHandler
from learner_node.publications import Publications
from learner_node.reports import (
    NEXT, numbers_from_learnt_bag, sentence_at_start, sentence_from_learnt_bag)
from learner_node.session.outputs import Outputs
from learner_node.session.phases import IN_TRIAL, Phase
from learner_node.session.session import Session

#: Of a robot that the field is not grown to.
_TOO_FAR: Final = (
    'the robot, or a start of start_poses, is too far away from what was learnt: {}. Drive it '
    'nearer, or begin another task (-p task:=...)')


class LearningLoop:
    """
    Learns from bags in the background, publishes the field, and lets the session go on with it.

    Parameters
    ----------
    node : LearnerNode
        Tells people, and answers requests that wait.
    session : Session
    task_memory : TaskMemory
    publications : Publications
    handler : OutputHandler

    """

    def __init__(
        self, node: Any, session: Session, task_memory: TaskMemory, publications: Publications,
        handler: OutputHandler,
    ) -> None:
        self._node, self._session = node, session
        self._task_memory = task_memory
        self._publications, self._handler = publications, handler
        self.newest: LearntBag | None = None  #: the bag that was learnt from last
        self.fatal = ''  #: why the learner cannot begin
        self.worker = BackgroundWorker()

    def begin(self, parameters: Parameters, now: float) -> None:
        """Learn from the bags that are there, and get the kernels ready."""
        self.worker.wake = self._node.create_guard_condition(self.worker.collect).trigger
        self.worker.do(self._task_memory.relearn, self._on_relearnt)
        self.worker.do(lambda: warm_up_kernels(parameters), self._on_done)
        self._session.begin(now)

    def learn(self, episode: EpisodeFolder) -> None:
        """Learn from a bag that was recorded."""
        self.worker.do(lambda: self._task_memory.learn(episode), self._on_learnt_bag)

    def note_gaps(self, episode: EpisodeFolder) -> None:
        """Note the gaps in a bag that is not learnt from."""
        self.worker.do(lambda: note_gaps(Episode(episode)), self._on_noted)

    def change_bags(self, change: str, *arguments: Any) -> None:
        """Change the bags of the task by a method of its memory, and relearn from all of them."""
        self.worker.do(partial(getattr(self._task_memory, change), *arguments), self._on_changed)

    def change_trials(self, change: Callable[[float], Outputs], now: float) -> Outputs:
        """Begin or stop trials; those that explore need a field of their own."""
        outputs, state = change(now), self._session.state
        if self._explores() and state.phase not in IN_TRIAL:
            self.publish_field(self._session.series.n_left > 0)
        return outputs

    def publish_field(self, more_trials: bool) -> None:
        """Publish the field, for the next trial where there is one; bags begin with it."""
        refresh = self._task_memory.driven
        if refresh is None:
            # A controller may still hold the field of bags that are gone, or of another task.
            self._publications.publish_nothing(self._task_memory.grid)
            self._handler.latch({})
            return
        field = self._task_memory.field(more_trials and self._explores())
        self._handler.latch(
            self._publications.publish_field(field, refresh, self._task_memory.memory))

    def make_room(self) -> None:
        """Let the published field hold the robot where it stands."""
        self.worker.do(self._task_memory.make_room, self._on_room_made)

    def _on_room_made(self, future: 'Future[None]') -> None:
        try:
            self.result(future)
        except TooLargeError as error:
            self._node.say(_TOO_FAR.format(error), warns=True)
            return
        self._node.say(f'the robot stands where the field did not reach; it has grown to '
                       f'{self._task_memory.grid.size}')
        self.publish_field(self._session.series.n_left > 0)

    def _explores(self) -> bool:
        """Return whether the trials of a series explore."""
        return self._task_memory.relearner.explores(
            self._session.state.settings.starts == 'spread')

    def result(self, future: 'Future[Any]') -> Any:
        """Return what a job of the worker came to, see `result_of`."""
        return result_of(future, self._node.get_logger().error)

    def _on_changed(self, future: 'Future[str]') -> None:
        try:
            text = self.result(future)
        except BagError as error:
            self.go_on()
            self._node.learner_services.answer(False, str(error), (
                'nothing_there' if isinstance(error, NothingThereError) else 'bags'))
            return
        self._learnt()
        self._node.say(text)
        self._node.learner_services.answer(True, text)

    def _on_relearnt(self, future: 'Future[list[str]]') -> None:
        try:
            lines: list[str] = self.result(future)
        except BagError as error:
            self.fatal = str(error)
            return
        self.begin_with(self._task_memory, lines)

    def begin_with(self, task_memory: TaskMemory, lines: list[str]) -> None:
        """
        Go on with a task whose bags were learnt from.

        Parameters
        ----------
        task_memory : TaskMemory
        lines : list of str
            What to tell people of that.

        """
        if task_memory is not self._task_memory:
            self._task_memory, self.newest = task_memory, None
        for line in lines:
            self._node.say(line)
        for line in self._task_memory.doubts:
            self._node.say(line, warns=True)
        self._node.say(sentence_at_start(
            self._session.state.settings, self._task_memory.task, self._task_memory.refresh))
        self._learnt()

    def _on_learnt_bag(self, future: 'Future[LearntBag]') -> None:
        try:
            newest: LearntBag = self.result(future)
        except BagError as error:
            self._handler.lose(error)
            return
        self.newest = newest
        self._learnt()
        is_demo, is_learnt = newest.folder.kind is EpisodeKind.DEMO, newest.refresh is not None
        sentence = sentence_from_learnt_bag(newest)
        if is_demo and is_learnt:
            sentence += f' {NEXT}'
        self._node.say(sentence, warns=is_demo and not is_learnt)
        if numbers := numbers_from_learnt_bag(newest):
            self._node.get_logger().info(f'in numbers: {numbers}')
        self._node.learner_services.answer(
            is_learnt, sentence, '' if is_learnt else newest.code or 'not_learnt')

    def _on_noted(self, future: 'Future[BagGaps]') -> None:
        try:
            gaps = self.result(future)
        except BagError as error:
            self._node.say(str(error), warns=True)
            return
        if gaps:
            self._node.say(str(gaps), warns=True)

    def _on_done(self, future: 'Future[None]') -> None:
        try:
            self.result(future)
        except BagError as error:
            self._node.say(str(error), warns=True)

    def _learnt(self) -> None:
        """Publish the field, then let the session go on with it."""
        self.publish_field(self._session.series.n_left > 1)
        if self._task_memory.too_far:
            self._node.say(_TOO_FAR.format(self._task_memory.too_far), warns=True)
        self._node.describe()
        self.go_on()
        # Aside, after what somebody waits for.
        self.worker.do(self._task_memory.find_places, self._on_done)

    def go_on(self) -> None:
        """Let the session go on with what is in force."""
        refresh, settings = self._task_memory.refresh, self._session.state.settings
        self._handler.carry_out(self._session.on_learnt(
            -1 if refresh is None else refresh.field.revision, time.monotonic(),
            self._task_memory.memory))
        missing = settings.auto_trials - self._task_memory.n_trials
        series, is_idle = self._session.series, self._session.state.phase is Phase.IDLE
        if (settings.auto_start and missing > 0 and refresh is not None and is_idle
                and not series.is_stopped):
            self._handler.carry_out(
                self.change_trials(partial(series.begin, missing), time.monotonic()))
