"""What the actions do: which services of learner and controller are asked, in which order."""

from collections.abc import Awaitable, Callable
from typing import Final, NamedTuple, Protocol

from teleop_node.keys import Action

_RECORDED: Final = (
    'cannot {} now: a drive is being recorded; press n to keep it, r to begin it anew, a to throw '
    'it away')
_STAYS: Final = (
    'The drive is still being recorded. Start teleop_node again soon to go on, and press n to '
    'keep it or a to throw it away. Later the recording ends by itself; nothing is lost, y keeps '
    'it')
_BACK: Final = 'drive the robot back to the start, then press s'
_TRYING: Final = 'cannot {} now: the robot tries by itself; press space to stop it'


#: Longest wait for an answer, [s]: learning takes a while; what stops the robot does not.
PATIENCE: Final = 60.0
STOP_PATIENCE: Final = 1.0


class Answer(NamedTuple):
    """What came of a request, and one sentence about it."""

    success: bool
    message: str

    @property
    def sentence(self) -> str:
        """Return what is told: what was done, or that it was not and why."""
        text = self.message if self.success else f'Not done: {self.message}'
        # Whoever reads it is in it. A bag's name stays as people have to type it.
        text = text.replace(' in teleop_node', '')
        begins = text[:1].upper() if text.split(' ')[0].isalpha() else text[:1]
        return f'{begins}{text[1:]}' + ('' if text.endswith(('.', '?', '!')) else '.')


def absence(node: str) -> str:
    """Say that a node is not there, and what to do."""
    return (f'{node} is not there; start it in another terminal, with the same ROS_DOMAIN_ID as '
            f'here')


class Peers(Protocol):
    """Whom an action asks; each call waits for its answer."""

    async def ask(
        self, service: str, on: bool | None = None, patience: float = PATIENCE,
    ) -> Answer:
        """Call a Trigger, or a SetBool with ``on``; wait that long for the answer, [s]."""

    async def is_simulated(self) -> bool | None:
        """Tell whether the learner may set the robot back; None if it does not answer."""

    async def set_back(self, to_start: bool) -> Answer:
        """Set a simulated robot to where trials start, or where the demonstration began."""

    async def set_where_to_teach(self) -> Answer:
        """Set a simulated robot to the next place where a demonstration would help."""

    def where_to_teach(self) -> Answer:
        """Say where a demonstration would help most."""

    def is_trying(self) -> bool:
        """Tell whether a trial runs."""

    def has_series(self) -> bool:
        """Tell whether the learner runs trials by itself, as far as is known."""

    def is_recording(self) -> bool:
        """Tell whether the learner records a demonstration."""

    def demonstration_began(self) -> None:
        """Take in that a demonstration begins where the robot is now."""

    def halt(self) -> None:
        """Stop the robot, whoever drives it."""

    def let_go(self) -> None:
        """Stop driving; a trial under way is not taken over by that."""

    def quit(self) -> None:
        """End the program."""


class Teaching:
    """
    Carries actions out, one at a time; only stopping and quitting never wait.

    Parameters
    ----------
    peers : Peers
        Whom to ask.
    learner, controller : str
        Names of the nodes.

    """

    def __init__(self, peers: Peers, learner: str, controller: str) -> None:
        """Start with nothing under way."""
        self._peers = peers
        self._learner = learner
        self._controller = controller
        self._busy = ''
        self._n_stops = 0
        self._plain: Final = {
            Action.KEEP: (f'{learner}/record_demonstration', False),
            Action.CANCEL: (f'{learner}/discard_demonstration', None),
            Action.DROP_LAST: (f'{learner}/drop_last', None),
            Action.UNDO: (f'{learner}/undo', None),
            Action.LABEL_SUCCESS: (f'{learner}/label_success', None),
            Action.LABEL_FAILURE: (f'{learner}/label_failure', None)}
        self._steps: Final[dict[Action, Callable[[], Awaitable[Answer]]]] = {
            Action.START: self._start, Action.REDO: self._redo,
            Action.SET_BACK: self._set_back, Action.TEACH_HERE: self._teach_here,
            Action.RUN_TRIALS: self._run_trials, Action.STOP: self._stop,
            Action.QUIT: self._quit}

    async def perform(self, action: Action) -> Answer:
        """Carry out an action; keys that are held are let go of first, whatever it is."""
        if action is Action.STOP:
            self._peers.halt()
        else:
            self._peers.let_go()
        if action in (Action.STOP, Action.QUIT):
            return await self._steps[action]()
        if self._busy:
            return Answer(False, f'still busy with {self._busy}')
        self._busy = action
        try:
            if action in self._plain:
                return await self._peers.ask(*self._plain[action])
            return await self._steps[action]()
        finally:
            self._busy = ''

    async def _start(self) -> Answer:
        answer = await self._peers.ask(f'{self._learner}/record_demonstration', True)
        if answer.success:
            self._peers.demonstration_began()
        return answer

    async def _redo(self) -> Answer:
        """
        Throw the running one away and begin anew; a simulated robot is set back for it.

        A real one has to be driven back first, and that is no part of the way.
        """
        answer = await self._peers.ask(f'{self._learner}/discard_demonstration')
        if not answer.success:
            return answer
        if not await self._peers.is_simulated():
            return Answer(True, f'{answer.message}; {_BACK}')
        then = await self._peers.set_back(to_start=False)
        if then.success:
            then = await self._start()
        return then._replace(message=f'{answer.message}; {then.message}')

    def _refusal(self, what: str) -> str:
        """Say why the robot must stay where it is; empty if it may be set elsewhere."""
        if self._peers.is_recording():
            return _RECORDED.format(what)
        return _TRYING.format(what) if self.drives_by_itself else ''

    async def _set_back(self) -> Answer:
        """Set a simulated robot back to the start."""
        if refusal := self._refusal('set the robot back'):
            return Answer(False, refusal)
        simulated = await self._peers.is_simulated()
        if simulated is None:
            return self._no_learner
        if not simulated:
            return Answer(False, 'a real robot is not set back: drive it back by the keys')
        return await self._peers.set_back(to_start=True)

    async def _teach_here(self) -> Answer:
        """Set a simulated robot to where to teach next; of a real one say where that is."""
        if refusal := self._refusal('set the robot elsewhere'):
            return Answer(False, refusal)
        simulated = await self._peers.is_simulated()
        if simulated is None:
            return self._no_learner
        if not simulated:
            return self._peers.where_to_teach()
        return await self._peers.set_where_to_teach()

    @property
    def _no_learner(self) -> Answer:
        return Answer(False, absence(self._learner))

    @property
    def drives_by_itself(self) -> bool:
        """Tell whether a trial or a series runs, or has just been asked for."""
        return self._busy == Action.RUN_TRIALS or self._peers.is_trying() or (
            self._peers.has_series())

    async def _run_trials(self) -> Answer:
        """Run trials; who stops meanwhile may have been quicker, and is to be right."""
        n_stops = self._n_stops
        answer = await self._ask_for_trials()
        if self._n_stops == n_stops or not answer.success:
            return answer
        return await self.end_trials()

    async def _ask_for_trials(self) -> Answer:
        """Ask for trials; with a real robot for one, from where it was put."""
        if await self._peers.is_simulated():
            return await self._peers.ask(f'{self._learner}/run_trials')
        if self._peers.is_recording():
            # The controller does not know of it, and what it drives would be recorded.
            return Answer(False, _RECORDED.format('run a trial'))
        return await self._peers.ask(f'{self._controller}/start_trial')

    async def _stop(self) -> Answer:
        if not self.drives_by_itself:
            return Answer(True, 'the robot stands')
        ended = await self.end_trials()
        return ended._replace(message=ended.message or 'the robot stands')

    async def end_trials(self) -> Answer:
        """
        End the trial under way and the series it belongs to, and say what was done.

        Both are asked whatever is known of them: a trial may just have been started. The
        controller comes first, so that the robot stands; and again where the learner's next trial
        was quicker than its answer.
        """
        drives = self.drives_by_itself
        self._n_stops += 1
        if drives:
            self._peers.halt()
        stopped = await self._ask_to_stop(f'{self._controller}/stop_trial')
        ended = await self._ask_to_stop(f'{self._learner}/stop_trials')
        if self._peers.is_trying() and not stopped.success:
            stopped = await self._ask_to_stop(f'{self._controller}/stop_trial')
        if self._peers.is_trying() and not stopped.success:
            return Answer(False, f'the trial may go on: {stopped.message}')
        said = [answer.message for answer in (stopped, ended) if answer.success]
        return Answer(True, '; '.join(said) if drives or ended.success else '')

    async def _ask_to_stop(self, service: str) -> Answer:
        return await self._peers.ask(service, patience=STOP_PATIENCE)

    async def _quit(self) -> Answer:
        """End the program, once nothing drives on that nobody would watch."""
        try:
            ended = await self.leave()
        finally:
            self._peers.quit()
        return Answer(True, ended.message or 'good bye')

    async def leave(self) -> Answer:
        """End trial and series before nobody watches them; say what stays under way."""
        ended = await self.end_trials()
        if not self._peers.is_recording():
            return ended
        return ended._replace(message='; '.join(filter(None, (ended.message, _STAYS))))
