"""Asking learner and controller: their services, and how long an answer is waited for."""

from collections.abc import Callable
from typing import Any, Final

from rcl_interfaces.srv import GetParameters
from std_srvs.srv import SetBool, Trigger

from teleop_node.teaching import absence, Answer, PATIENCE

#: Services of the learner that actions ask for, beside that which records.
_LEARNER: Final = (
    'discard_demonstration', 'drop_last', 'label_success', 'label_failure', 'run_trials',
    'stop_trials', 'undo')
_CONTROLLER: Final = ('start_trial', 'stop_trial')


class Asking:
    """
    The services that are asked.

    Parameters
    ----------
    node : Node
        Whose clients they are.
    learner, controller : str
        Names of the nodes.
    future : callable
        Makes a future of the node's executor.
    clock : Clock
        A steady one.

    """

    def __init__(
        self, node: Any, learner: str, controller: str, future: Callable[[], Any], clock: Any,
    ) -> None:
        """Make the clients."""
        self._node, self._clock = node, clock
        self.future = future
        self._record = node.create_client(SetBool, f'{learner}/record_demonstration')
        self._parameters = node.create_client(GetParameters, f'{learner}/get_parameters')
        names = [f'{learner}/{name}' for name in _LEARNER]
        names += [f'{controller}/{name}' for name in _CONTROLLER]
        self._triggers = {name: node.create_client(Trigger, name) for name in names}

    async def ask(
        self, service: str, on: bool | None = None, patience: float = PATIENCE,
    ) -> Answer:
        """Call a service of learner or controller; wait that long for the answer, [s]."""
        client = self._triggers[service] if on is None else self._record
        request = Trigger.Request() if on is None else SetBool.Request(data=on)
        answer = await self._answer(client, request, patience)
        if answer is None:
            node = service.rpartition('/')[0]
            return Answer(False, f'{node} does not answer' if client.service_is_ready() else (
                absence(node)))
        return Answer(answer.success, answer.message)

    async def _answer(self, client: Any, request: Any, patience: float = PATIENCE) -> Any:
        """Return the answer of a service; None if there is none."""
        if not client.service_is_ready():
            return None
        future = client.call_async(request)
        answer = await self.within(future, patience)
        client.remove_pending_request(future)
        return answer

    async def within(self, future: Any, seconds: float) -> Any:
        """Return the result of a future, None when that takes longer."""
        timer = self._node.create_timer(
            seconds, lambda: future.done() or future.set_result(None), clock=self._clock)
        try:
            return await future
        finally:
            self._node.destroy_timer(timer)

    async def is_simulated(self) -> bool | None:
        """Ask the learner whether it may set the robot back; None if it does not answer."""
        request = GetParameters.Request(names=['simulation'])
        answer = await self._answer(self._parameters, request)
        if answer is None or not answer.values:
            return None
        return bool(answer.values[0].bool_value)
