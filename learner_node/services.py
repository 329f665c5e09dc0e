"""The services of the learner, for people, pages and gamepads."""

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from std_srvs.srv import SetBool, Trigger

from control_field.words import counted
from learner_node.learning.learning_loop import LearningLoop
from learner_node.session.outputs import Outputs
from learner_node.session.phases import SessionError
from learner_node.session.session import Session
from msgs_bridge.messages.trial_status import Label

#: What is asked of the session at a time, [s], such as `Demonstration.keep`.
Request = Callable[[float], Outputs]


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

    """

    def __init__(
        self, node: Any, session: Session, learning: LearningLoop,
        carry_out: Callable[[Outputs], None], collect: Callable[[], None],
        future: Callable[[], Any], group: Any,
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
        for name, callback in (
                ('drop_last', partial(self._on_change, 'drop_last')),
                ('undo', partial(self._on_change, 'undo')),
                ('label_success', partial(self._on_change, 'label_last', Label.SUCCESS)),
                ('label_failure', partial(self._on_change, 'label_last', Label.FAILURE))):
            node.create_service(Trigger, f'~/{name}', callback, callback_group=group)
        node.create_service(Trigger, '~/discard_demonstration', self._on_discard)
        node.create_service(Trigger, '~/run_trials', self._on_run)
        node.create_service(Trigger, '~/stop_trials', self._on_stop)

    def answer(self, success: bool, text: str) -> None:
        """Answer the request that waits, if there is one."""
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            waiting.set_result((success, text))

    async def _on_record(self, request: Any, response: Any) -> Any:
        """Begin a demonstration, or keep it; the answer to that says what was learnt."""
        if not request.data:
            return await self._after(response, self._session.demonstration.keep)
        success, text = self._try(self._session.demonstration.record)
        response.success = success and self._session.state.is_recording
        response.message = text or self._node.said
        return response

    async def _on_change(self, change: str, *arguments: Any) -> Any:
        """Change the bags of the task, and relearn from all of them."""
        *values, _, response = arguments
        return await self._after(
            response, self._session.relearn, partial(self._learning.change_bags, change, *values))

    def _on_discard(self, _: Any, response: Any) -> Any:
        return self._at_once(response, self._session.demonstration.discard)

    def _on_run(self, _: Any, response: Any) -> Any:
        n = self._session.state.settings.auto_trials
        return self._at_once(response, partial(
            self._learning.change_trials, partial(self._session.series.run, n)),
            f'the robot tries {counted(n, "time")}; press space in teleop_node to stop it')

    def _on_stop(self, _: Any, response: Any) -> Any:
        return self._at_once(
            response, partial(self._learning.change_trials, self._session.series.stop),
            'no more trials are run')

    def _try(self, request: Request) -> tuple[bool, str]:
        """Do what is asked for; return whether that can be done, and why not."""
        self._collect()
        try:
            outputs = request(time.monotonic())
        except SessionError as error:
            return False, str(error)
        self._carry_out(outputs)
        return True, ''

    def _at_once(self, response: Any, request: Request, success: str = '') -> Any:
        response.success, text = self._try(request)
        response.message = text or success or self._node.said
        return response

    async def _after(
        self, response: Any, request: Request, work: Callable[[], None] = lambda: None,
    ) -> Any:
        """Answer once the learner has learnt from what is asked for."""
        response.success, response.message = self._try(request)
        if response.success:
            # Only now: what is refused must not take the answer of what is under way.
            waiting = self._waiting = self._future()
            work()
            response.success, response.message = await waiting
        return response
