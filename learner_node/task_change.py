"""Another task for a learner that is idle: learnt from first, and in force only after that."""

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from functools import partial
import time
from typing import Any, Final

from rcl_interfaces.msg import SetParametersResult

from episode_store.lock import check_unused
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder
from learner_node.learning.learning_loop import LearningLoop
from learner_node.learning.task_memory import TaskMemory
from learner_node.session.session import Session
from msgs_bridge.node.node_info import Operation

_WHAT: Final = 'begin another task'


class TaskChange:
    """
    Lets the parameter `task` become another one while nothing is under way.

    The bags of the other task are learnt from aside. Until that is done, and if it fails, the
    learner is at the task it had: no bag is made and no field published of one that is not whole.

    Parameters
    ----------
    node : LearnerNode
        Whose task it is.
    session : Session
    learning : LearningLoop
    memory_of : callable
        Makes the memory of a task.

    """

    def __init__(
        self, node: Any, session: Session, learning: LearningLoop,
        memory_of: Callable[[TaskFolder], TaskMemory],
    ) -> None:
        self._node, self._session, self._learning = node, session, learning
        self._memory_of = memory_of
        node.add_on_set_parameters_callback(self._check)

    def _check(self, parameters: list[Any]) -> SetParametersResult:
        named = {parameter.name: parameter.value for parameter in parameters}
        try:
            if named.get('task', self._current) != self._current:
                self._check_now(named)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    @property
    def _current(self) -> str:
        return self._session.state.settings.task

    def _check_now(self, named: Mapping[str, Any]) -> None:
        """Raise ValueError if the task cannot become another one now, or not that one."""
        settings = self._session.state.settings
        self._session.check_between(_WHAT, Operation.CHANGE)
        task = TaskFolder(settings.bags, named['task'])
        if not named.get('new_task', settings.new_task):
            task.check_is_meant()
        check_unused(task.path)

    def begin(self, name: str) -> None:
        """Learn from the bags of another task, which was checked."""
        self._session.begin(time.monotonic())
        self._node.tell()
        task = TaskFolder(self._session.state.settings.bags, name)
        self._learning.worker.do(
            partial(self._learn, task), partial(self._on_learnt, task))

    def _learn(self, task: TaskFolder) -> tuple[TaskMemory, list[str]]:
        task.hold()
        memory = self._memory_of(task)
        return memory, memory.relearn()

    def _on_learnt(self, task: TaskFolder, future: 'Future[tuple[TaskMemory, list[str]]]') -> None:
        try:
            memory, lines = self._learning.result(future)
        except BagError as error:
            task.release()
            self._node.say(f'the task stays {self._current}: {error}', warns=True)
            self._node.stay()
            self._learning.go_on()
            return
        self._node.enter(memory)
        self._session.on_other_task()
        self._learning.begin_with(memory, lines)
