"""The services of the learner, for people, pages and gamepads."""

from collections.abc import Awaitable, Callable, Mapping
from functools import partial
import time
from typing import Any, Final, NamedTuple

from rcl_interfaces.srv import SetParameters
from std_srvs.srv import SetBool, Trigger

from control_field.words import counted
from learner_node.learning.learning_loop import LearningLoop
from learner_node.session.outputs import Outputs
from learner_node.session.phases import SessionError
from learner_node.session.session import Session
from msgs_bridge.messages.learner_requests import action_from_request, fill_response, SERVICE
from msgs_bridge.messages.trial_status import Label
from msgs_bridge.untrusted.text import printable

#: What is asked of the session at a time, [s], such as `Demonstration.keep`.
Request = Callable[[float], Outputs]
#: What an action of `~/request` may be asked with.
_VALUES: Final[Mapping[str, set[str]]] = {
    'run_trials': {'n'}, 'drop': {'episode'}, 'label_success': {'episode'},
    'label_failure': {'episode'}}
#: Most trials that are run at one request.
_MOST_TRIALS: Final = 1000


class Answered(NamedTuple):
    """What came of a request: a sentence about it, and a code for a page with its own words."""

    success: bool
    message: str
    code: str = ''


class LearnerServices:
    """
    Hands requests to the session, and answers them.

    An answer that has to wait for what is learnt is given by `answer`.

    Parameters
    ----------
    node : LearnerNode
        Whose services they are.
    session : Session
    learning : LearningLoop
    carry_out : callable
        Does what the session wants done.
    collect : callable
        Records, and hands to the session, what arrived before a request: a person keeps what
        was driven until then, also where the messages of it still wait.
    future : callable
        Makes a future of the node's executor.
    group : callback group
        Of the services whose answers wait; the rest of the node must go on meanwhile.
    reentrant : callback group
        Of the service whose answers may wait or not, as it is asked.

    """

    def __init__(
        self, node: Any, session: Session, learning: LearningLoop,
        carry_out: Callable[[Outputs], None], collect: Callable[[], None],
        future: Callable[[], Any], group: Any, reentrant: Any,
    ) -> None:
        self._node = node
        self._session = session
        self._learning = learning
        self._carry_out = carry_out
        self._collect = collect
        self._future = future
        self._waiting: Any = None
        node.create_service(
            SetBool, '~/record_demonstration', self._on_record, callback_group=group)
        #: What `~/request` may be asked for, and what answers it.
        self._actions: Final[dict[str, Callable[..., Awaitable[Answered]]]] = {
            'record': self._record, 'keep': self._keep, 'discard': self._discard,
            'drop': partial(self._change, 'drop'), 'undo': partial(self._change, 'undo'),
            'label_success': partial(self._change, 'label', Label.SUCCESS),
            'label_failure': partial(self._change, 'label', Label.FAILURE),
            'run_trials': self._run, 'stop_trials': self._stop}
        for name, action in (('drop_last', 'drop'), ('undo', 'undo'),
                             ('label_success', 'label_success'),
                             ('label_failure', 'label_failure')):
            node.create_service(
                Trigger, f'~/{name}', self._trigger(action), callback_group=group)
        for name, action in (('discard_demonstration', 'discard'), ('run_trials', 'run_trials'),
                             ('stop_trials', 'stop_trials')):
            node.create_service(Trigger, f'~/{name}', self._trigger(action))
        node.create_service(
            SetParameters, f'~/{SERVICE}', self._on_request, callback_group=reentrant)

    def answer(self, success: bool, text: str, code: str = '') -> None:
        """Answer the request that waits, if there is one."""
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            waiting.set_result(Answered(success, text, code))

    async def _on_record(self, request: Any, response: Any) -> Any:
        """Begin a demonstration, or keep it; the answer to that says what was learnt."""
        answered = await (self._record if request.data else self._keep)()
        response.success, response.message, _ = answered
        return response

    def _trigger(self, action: str) -> Any:
        async def serve(_: Any, response: Any) -> Any:
            response.success, response.message, _ = await self._actions[action]()
            return response

        return serve

    async def _on_request(self, request: Any, response: Any) -> Any:
        """Answer a page, which asks with values and wants a code."""
        try:
            action, values = action_from_request(request)
            if action not in self._actions or not {*values} <= _VALUES.get(action, set()):
                raise ValueError(f'request: {printable(action, 40)!r} with {[*values]} is nothing '
                                 f'that can be asked for')
            answered = await self._actions[action](**values)
        except ValueError as error:
            answered = Answered(False, str(error), 'malformed')
        return fill_response(response, *answered)

    async def _record(self) -> Answered:
        answered = self._try(self._session.demonstration.record)
        if answered.success and not self._session.state.is_recording:
            return Answered(False, self._node.said, 'disk')
        return answered._replace(message=answered.message or self._node.said)

    async def _keep(self) -> Answered:
        return await self._after(self._session.demonstration.keep)

    async def _change(self, change: str, *arguments: Any, episode: str = '') -> Answered:
        """Change a bag of the task, the last where none is named, and relearn from all of them."""
        named = (*arguments, episode) if episode else arguments
        return await self._after(
            self._session.relearn, partial(self._learning.change_bags, change, *named))

    async def _discard(self) -> Answered:
        return self._at_once(self._session.demonstration.discard)

    async def _run(self, n: int = 0) -> Answered:
        if not 0 <= n <= _MOST_TRIALS:
            raise ValueError(f'n is {n}, must be 1 to {_MOST_TRIALS}')
        n = n or self._session.state.settings.auto_trials
        return self._at_once(partial(
            self._learning.change_trials, partial(self._session.series.run, n)),
            f'the robot tries {counted(n, "time")}; press space in teleop_node to stop it')

    async def _stop(self) -> Answered:
        return self._at_once(partial(
            self._learning.change_trials, self._session.series.stop), 'no more trials are run')

    def _try(self, request: Request) -> Answered:
        """Do what is asked for; return whether that can be done, and why not."""
        self._collect()
        try:
            outputs = request(time.monotonic())
        except SessionError as error:
            return Answered(False, str(error), error.code)
        self._carry_out(outputs)
        return Answered(True, '')

    def _at_once(self, request: Request, success: str = '') -> Answered:
        answered = self._try(request)
        return answered._replace(message=answered.message or success or self._node.said)

    async def _after(
        self, request: Request, work: Callable[[], None] = lambda: None,
    ) -> Answered:
        """Answer once the learner has learnt from what is asked for."""
        answered = self._try(request)
        if answered.success:
            # Only now: what is refused must not take the answer of what is under way.
            waiting = self._waiting = self._future()
            work()
            answered = await waiting
        return answered
