"""Service requests of the learner to the controller."""

from collections.abc import Callable
from typing import Any, Final

from std_srvs.srv import Trigger

from learner_node.session.inputs import Peers

#: Called with the answer: whether the controller does what it was asked for, and its message.
Answered = Callable[[bool, str], None]

#: Requests without an answer that are kept: a stop is repeated for as long as a trial runs.
_MOST_OPEN: Final = 8


class Requests:
    """
    Requests to the controller, of which none from before a start can arrive after it.

    A request that nobody has answered may be delivered yet: the middleware sends it again for
    seconds, and a controller that died and was started anew gets it in the middle of its next
    trial. What is still open goes with its client, therefore, before the next start. A stop takes
    back no more than a start that still waits for the controller.

    Parameters
    ----------
    node : Node
        Whose clients they are.
    controller : str
        Name of the controller.

    """

    def __init__(self, node: Any, controller: str) -> None:
        self._node = node
        self._names = {kind: f'{controller}/{kind}_trial' for kind in ('start', 'stop')}
        self._clients = {kind: self._client(kind) for kind in self._names}
        self._open: list[tuple[str, Any]] = []
        #: Kinds of requests that were dropped without an answer, and may arrive yet.
        self._lost: set[str] = set()
        self._waiting: Answered | None = None

    def _client(self, kind: str) -> Any:
        return self._node.create_client(Trigger, self._names[kind])

    def is_there(self) -> bool:
        """Return True if there is a controller."""
        return bool(self._node.count_services(
            self._node.resolve_service_name(self._names['start'])))

    def peers(self) -> Peers:
        """Return who is there; a controller counts once its topic is there, too."""
        return Peers(self.is_there() and self._is_published('experience'),
                     self._is_published('odom'))

    def _is_published(self, topic: str) -> bool:
        # What is counted are names after remapping.
        return bool(self._node.count_publishers(self._node.resolve_topic_name(topic)))

    def start(self, answered: Answered) -> None:
        """Request a trial as soon as the controller's service is there."""
        self._withdraw()
        self._waiting = answered
        self.send()

    def stop(self, answered: Answered) -> None:
        """Request that the trial is stopped."""
        self._waiting = None
        self._ask('stop').add_done_callback(lambda future: _tell(future, answered))

    def send(self) -> None:
        """Send a start that waits, if the service is there by now; call it at every tick."""
        if self._waiting is not None and self._clients['start'].service_is_ready():
            answered, self._waiting = self._waiting, None
            self._ask('start').add_done_callback(lambda future: _tell(future, answered))

    def _ask(self, kind: str) -> Any:
        self._tidy()
        future = self._clients[kind].call_async(Trigger.Request())
        self._open.append((kind, future))
        return future

    def _tidy(self) -> None:
        """Drop answered requests, and the oldest of the others if there are too many."""
        self._open = [(kind, future) for kind, future in self._open if not future.done()]
        while len(self._open) >= _MOST_OPEN:
            kind, future = self._open.pop(0)
            self._clients[kind].remove_pending_request(future)
            self._lost.add(kind)

    def _withdraw(self) -> None:
        """Withdraw all requests that nobody has answered."""
        for kind in {kind for kind, future in self._open if not future.done()} | self._lost:
            self._node.destroy_client(self._clients[kind])
            self._clients[kind] = self._client(kind)
        self._open.clear()
        self._lost.clear()


def _tell(future: Any, answered: Answered) -> None:
    answer = future.result()
    if answer is not None:
        answered(answer.success, answer.message)
