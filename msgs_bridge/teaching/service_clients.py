"""The services of learner and controller that actions ask for."""

from collections.abc import Mapping
import time
from typing import Any, ClassVar, Final

from rcl_interfaces.srv import GetParameters
from std_srvs.srv import SetBool, Trigger

from msgs_bridge.node.node_info import Operation
from msgs_bridge.teaching.answers import absence, Answer
from msgs_bridge.teaching.status_tracker import StatusTracker
from msgs_bridge.teaching.timeouts import Timeouts

#: Services of the learner that actions ask for, beside that which records.
_LEARNER: Final = (
    'discard_demonstration', 'drop_last', 'label_success', 'label_failure', 'run_trials',
    'stop_trials', 'undo')
CONTROLLER: Final = ('start_trial', 'stop_trial')
#: Those that end a trial, which is right whoever hears it; keeping a drive is, too.
_ENDING: Final = ('stop_trial', 'stop_trials')
#: Longest wait for an answer, [s]: learning takes a while.
PATIENCE: Final = 60.0


class ServiceClients:
    """
    Asks learner and controller, and tells the status what came of it.

    Parameters
    ----------
    node : Node
        Whose clients they are.
    learner, controller : str
        Names of the two nodes.
    status : StatusTracker
    peers : PeerMonitor
        Knows whether two could hear a request.
    timeouts : Timeouts

    """

    #: Services that are asked through a client each.
    asked_plainly: ClassVar[tuple[str, ...]] = ('record_demonstration', *_LEARNER, *CONTROLLER)

    def __init__(
        self, node: Any, learner: str, controller: str, status: StatusTracker, peers: Any,
        timeouts: Timeouts,
    ) -> None:
        """Make the clients."""
        self.learner = learner
        self._status, self._peers, self._timeouts = status, peers, timeouts
        self._names = {
            **{name: f'{learner}/{name}' for name in ('record_demonstration', *_LEARNER)},
            **{name: f'{controller}/{name}' for name in CONTROLLER}}
        self._clients = {
            name: node.create_client(SetBool if name == 'record_demonstration' else Trigger, full)
            for name, full in self._names.items() if name in self.asked_plainly}
        self._parameters = node.create_client(
            GetParameters, f'{learner}/get_parameters')

    async def ask(
        self, service: str, on: bool | None = None, patience: float = PATIENCE, **values: Any,
    ) -> Answer:
        """
        Call a service; where two could hear it, only one that ends something.

        Parameters
        ----------
        service : str
            Such as ``drop_last``.
        on : bool, optional
            What `record_demonstration` is asked for.
        patience : float, [s]
            Longest wait for the answer.
        **values
            What it is about, for those that can be asked so.

        """
        # A request reaches whichever of them is there, the neighbour's, too.
        if on is not False and service not in _ENDING and (
                why := self._peers.why_not(Operation.CHANGE)):
            return Answer(False, why, 'conflict')
        answer = await self._request(service, on, patience, values)
        self._status.on_answer(service, on, answer.success, time.monotonic())
        return answer

    async def _request(
        self, service: str, on: bool | None, patience: float, values: Mapping[str, Any],
    ) -> Answer:
        assert not values, f'{service} is not asked with values'
        request = Trigger.Request() if on is None else SetBool.Request(data=on)
        client = self._clients[service]
        response = await self._call(client, request, patience)
        if response is None:
            return self._silence(service, client)
        return Answer(response.success, response.message, (
            '' if response.success else 'refused'))

    def _silence(self, service: str, client: Any) -> Answer:
        """Say that a service has not answered, and whether anybody is there."""
        node, is_learner = self._names[service].rpartition('/')[0], service not in CONTROLLER
        if client.service_is_ready():
            return Answer(False, f'{node} does not answer', 'no_answer')
        return Answer(False, absence(node), 'no_learner' if is_learner else 'no_controller')

    async def _call(self, client: Any, request: Any, patience: float) -> Any:
        """Return the answer of a service; None if there is none."""
        if not client.service_is_ready():
            return None
        future = client.call_async(request)
        answer = await self._answer_of(future, patience)
        client.remove_pending_request(future)
        return answer

    async def _answer_of(self, future: Any, patience: float) -> Any:
        return await self._timeouts.within(future, patience)

    async def is_simulated(self, patience: float = 0.0) -> bool | None:
        """
        Ask the learner whether it may set the robot back; None if it does not answer.

        Parameters
        ----------
        patience : float, [s]
            Longest wait for a learner that must be there, but may not have been found yet.

        """
        client = self._parameters
        await self._timeouts.until(client.service_is_ready, time.monotonic() + patience)
        answer = await self._call(
            client, GetParameters.Request(names=['simulation']), PATIENCE)
        if answer is None or not answer.values:
            return None
        return bool(answer.values[0].bool_value)
