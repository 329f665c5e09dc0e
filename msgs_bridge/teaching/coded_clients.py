"""The services of learner and controller, asked so that answers carry a code."""

from collections.abc import Mapping
import time
from typing import Any, Final

from rcl_interfaces.srv import SetParameters

from msgs_bridge.messages.learner_requests import (
    answer_from_response, request_from_action, SERVICE)
from msgs_bridge.teaching.answers import absence, Answer
from msgs_bridge.teaching.service_clients import CONTROLLER, ServiceClients

#: What the learner calls the actions of services that are named otherwise.
_ACTIONS: Final[Mapping[str, str]] = {'discard_demonstration': 'discard', 'drop_last': 'drop'}
#: What `record_demonstration` is asked for.
_RECORD: Final = {True: 'record', False: 'keep'}
#: How often is looked whether a learner that is to answer is still heard, [s].
_LOOK_PERIOD: Final = 0.5


class CodedClients(ServiceClients):
    """
    Asks the learner through `~/request`: with values, and for a code in its answer.

    A learner that fell silent is not waited for: it was killed, say, and ROS does not know yet.
    """

    #: The controller has sentences only.
    asked_plainly = CONTROLLER

    def __init__(self, node: Any, learner: str, *others: Any) -> None:
        """Make the clients; arguments are those of `ServiceClients`."""
        super().__init__(node, learner, *others)
        self._coded = node.create_client(SetParameters, f'{learner}/{SERVICE}')

    async def _request(
        self, service: str, on: bool | None, patience: float, values: Mapping[str, Any],
    ) -> Answer:
        if service in self.asked_plainly:
            return await super()._request(service, on, patience, values)
        if not self._is_heard():
            return Answer(False, absence(self.learner), 'no_learner')
        action = _ACTIONS.get(service, service) if on is None else _RECORD[on]
        response = await self._call(self._coded, request_from_action(action, values), patience)
        if response is None:
            return self._silence(service, self._coded) if self._is_heard() else Answer(
                False, absence(self.learner), 'no_learner')
        try:
            return Answer(*answer_from_response(response))
        except ValueError as error:
            return Answer(False, str(error), 'refused')

    def _is_heard(self) -> bool:
        return self._status.has_learner(time.monotonic())

    async def _answer_of(self, future: Any, patience: float) -> Any:
        def look() -> None:
            if not (future.done() or self._is_heard()):
                future.set_result(None)

        with self._timeouts.repeating(_LOOK_PERIOD, look):
            return await super()._answer_of(future, patience)
