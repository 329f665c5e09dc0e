"""Another world for the simulator, another task for the learner: their parameters, when idle."""

from collections.abc import Callable, Mapping
import time
from typing import Any, Final, NamedTuple

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParametersAtomically

from msgs_bridge.teaching.answers import absence, Answer
from msgs_bridge.teaching.timeouts import Timeouts

#: Longest wait for an answer, [s]: a large map takes a while to read.
_PATIENCE: Final = 60.0
#: Longest wait until the learner has learnt from the bags of another task, [s].
_LEARNING: Final = 120.0
#: How often it is asked whether it has given that up, [s].
_LOOK_PERIOD: Final = 0.5


class Standing(NamedTuple):
    """
    How things stand, as far as the page knows.

    Parameters
    ----------
    task : str
        The learner's; empty where there is none.
    is_busy : bool
        Whether anything is under way.
    is_simulated : bool

    """

    task: str
    is_busy: bool
    is_simulated: bool


class Changer:
    """
    Sets the parameters of simulator and learner that make another world, another task.

    Parameters
    ----------
    node : Node
        Whose clients it uses.
    simulator, learner : str
        Names of the two nodes.
    timeouts : Timeouts
    standing : callable
        Returns how things stand.

    """

    def __init__(
        self, node: Any, simulator: str, learner: str, timeouts: Timeouts,
        standing: Callable[[], Standing],
    ) -> None:
        """Make the clients."""
        self._names = {'world': simulator, 'task': learner}
        self._timeouts, self._standing = timeouts, standing
        self._getters = {name: node.create_client(GetParameters, f'{whose}/get_parameters')
                         for name, whose in self._names.items()}
        self._setters = {name: node.create_client(
            SetParametersAtomically, f'{whose}/set_parameters_atomically')
            for name, whose in self._names.items()}
        self._is_changing = False

    async def world(self) -> str:
        """Return the simulator's world, as it is told there; empty if nobody answers."""
        return await self._get('world')

    async def change(
        self, world: str | None = None, task: str | None = None, is_new: bool = False,
    ) -> Answer:
        """
        Let the nodes have another world, another task, or both or none.

        Parameters
        ----------
        world : str, optional
            What the simulator finds it by; one that is in use is read again.
        task : str, optional
        is_new : bool
            Whether the task's name is meant so, though it is nearly that of another one.

        """
        standing = self._standing()
        if world is not None and not standing.is_simulated:
            return Answer(False, 'the robot is a real one: its world is what it is', 'real_robot')
        if standing.is_busy or self._is_changing:
            return Answer(False, 'something is under way: stop or keep it first', 'busy')
        self._is_changing = True
        try:
            return await self._change_both(world, task if task != standing.task else None, is_new)
        finally:
            self._is_changing = False

    async def _change_both(self, world: str | None, task: str | None, is_new: bool) -> Answer:
        """Change the task first: of a new one nothing is learnt that could not fit the world."""
        before = self._standing().task
        if task is not None and not (answer := await self._change_task(task, is_new)).success:
            return answer
        answer = Answer(True, '', 'done') if world is None else await self._set(
            'world', {'world': world})
        if not answer.success and task is not None and before:
            await self._change_task(before, True)  # both or none
        return answer

    async def _change_task(self, task: str, is_new: bool) -> Answer:
        answer = await self._set('task', {'task': task, 'new_task': is_new})
        if not answer.success:
            return answer
        deadline = time.monotonic() + _LEARNING
        while time.monotonic() < deadline:
            if await self._timeouts.until(
                    lambda: self._is_at(task), time.monotonic() + _LOOK_PERIOD):
                return Answer(True, '', 'done')
            if await self._get('task') not in (task, ''):
                return Answer(False, 'the bags of that task cannot be learnt from, see what the '
                              'learner says', 'bags')
        return Answer(False, 'the learner is still learning from the bags of that task',
                      'no_answer')

    def _is_at(self, task: str) -> bool:
        standing = self._standing()
        return standing.task == task and not standing.is_busy

    async def _get(self, name: str) -> str:
        response = await self._call(self._getters[name], GetParameters.Request(names=[name]))
        return '' if response is None or not response.values else str(
            response.values[0].string_value)

    async def _set(self, name: str, values: Mapping[str, str | bool]) -> Answer:
        client = self._setters[name]
        response = await self._call(client, SetParametersAtomically.Request(
            parameters=[_parameter(*each) for each in values.items()]))
        if response is not None:
            result = response.result
            return Answer(result.successful, result.reason, (
                'done' if result.successful else f'{name}_refused'))
        if client.service_is_ready():
            return Answer(False, f'{self._names[name]} does not answer', 'no_answer')
        return Answer(False, absence(self._names[name]), (
            'no_simulator' if name == 'world' else 'no_learner'))

    async def _call(self, client: Any, request: Any) -> Any:
        """Return the answer of a service; None if there is none."""
        if not client.service_is_ready():
            return None
        future = client.call_async(request)
        answer = await self._timeouts.within(future, _PATIENCE)
        client.remove_pending_request(future)
        return answer


def _parameter(name: str, value: str | bool) -> Any:
    if isinstance(value, bool):
        return Parameter(name=name, value=ParameterValue(
            type=ParameterType.PARAMETER_BOOL, bool_value=value))
    return Parameter(name=name, value=ParameterValue(
        type=ParameterType.PARAMETER_STRING, string_value=value))
