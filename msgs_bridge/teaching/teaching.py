"""What the actions do: which services of learner and controller are asked, in which order."""

from collections.abc import Awaitable, Callable, Mapping
from functools import partial
import time
from typing import Any, Final

from msgs_bridge.teaching.actions import Action, DOING
from msgs_bridge.teaching.answers import absence, Answer
from msgs_bridge.teaching.robot_placement import RobotPlacement, where_to_teach
from msgs_bridge.teaching.service_clients import ServiceClients
from msgs_bridge.teaching.status_tracker import StatusTracker
from msgs_bridge.teaching.velocity_publisher import Commands

_RECORDED: Final = (
    'cannot {} now: a drive is being recorded; press n to keep it, r to begin it anew, a to throw '
    'it away')
_STAYS: Final = (
    'The drive is still being recorded. Start teleop_node again soon to go on, and press n to '
    'keep it or a to throw it away. Later the recording ends by itself; nothing is lost, y keeps '
    'it')
_BACK: Final = 'drive the robot back to the start, then press s'
_TRYING: Final = 'cannot {} now: the robot tries by itself; press space to stop it'

#: Longest wait for the answer of what stops the robot, [s].
_STOP_PATIENCE: Final = 1.0
#: Longest wait for a service of a learner that has just answered, [s].
_FINDING_TIME: Final = 5.0
#: The code of what needs a learner.
NO_LEARNER: Final = 'no_learner'
#: Actions that never wait for another.
_URGENT: Final = (Action.STOP, Action.QUIT)


class Teaching:
    """
    Carries actions out, one at a time; only stopping and quitting never wait.

    Parameters
    ----------
    services : ServiceClients
    placement : RobotPlacement
    status : StatusTracker
    commands : Commands

    """

    def __init__(
        self, services: ServiceClients, placement: RobotPlacement, status: StatusTracker,
        commands: Commands,
    ) -> None:
        """Start with nothing under way."""
        self.has_quit = False  #: whether the program is to end; nothing drives on then
        self._services, self._placement = services, placement
        self._status, self._commands = status, commands
        self._under_way: set[Action] = set()
        self._n_stops = 0
        ask = partial(partial, services.ask)
        self._steps: Final[dict[Action, Callable[..., Awaitable[Answer]]]] = {
            Action.START: self._start, Action.KEEP: ask('record_demonstration', False),
            Action.REDO: self._redo, Action.CANCEL: ask('discard_demonstration'),
            Action.DROP_LAST: ask('drop_last'), Action.UNDO: ask('undo'),
            Action.LABEL_SUCCESS: ask('label_success'),
            Action.LABEL_FAILURE: ask('label_failure'),
            Action.SET_BACK: self._set_back, Action.TEACH_HERE: self._teach_here,
            Action.RUN_TRIALS: self._run_trials, Action.STOP: self._stop,
            Action.QUIT: self._quit}

    @property
    def is_stopping(self) -> bool:
        """Whether a stop is under way."""
        return Action.STOP in self._under_way

    @property
    def drives_by_itself(self) -> bool:
        """Whether a trial or a series runs, or has just been asked for."""
        return (Action.RUN_TRIALS in self._under_way or self._status.is_trying
                or self._status.has_series(time.monotonic()))

    async def perform(self, action: Action, **values: Any) -> Answer:
        """
        Carry out an action; keys that are held are let go of first, whatever it is.

        Parameters
        ----------
        action : Action
        **values
            What it is about, where there is more to say than by a key: the `episode` that is
            labelled or removed, how many trials to run (`n`), a place to teach from (`x`, `y`).

        """
        if action is Action.STOP:
            self._commands.halt()
        else:
            self._commands.let_go()
        for other in self._under_way.difference(_URGENT):
            if action not in _URGENT:
                return Answer(False, f'still {DOING[other]}; press it again when that is done',
                              'busy')
        self._under_way.add(action)
        try:
            return await self._steps[action](**values)
        finally:
            self._under_way.discard(action)

    async def _start(self) -> Answer:
        answer = await self._services.ask('record_demonstration', True)
        if answer.success:
            await self._placement.mark_start()
        return answer

    async def _redo(self) -> Answer:
        """
        Throw the running one away and begin anew; a simulated robot is set back for it.

        A real one has to be driven back first, and that is no part of the way.
        """
        answer = await self._services.ask('discard_demonstration')
        if not answer.success:
            return answer
        simulated = await self._services.is_simulated(_FINDING_TIME)
        if simulated is None:
            return Answer(
                False, f'{answer.message}; {absence(self._services.learner)}', NO_LEARNER)
        if not simulated:
            return Answer(True, f'{answer.message}; {_BACK}', 'drive_back')
        then = await self._placement.set_back()
        if then.success:
            then = await self._start()
        return then._replace(message=f'{answer.message}; {then.message}')

    @property
    def _is_recording(self) -> bool:
        return self._status.is_recording(time.monotonic())

    def _refusal(self, what: str) -> Answer | None:
        """Say why the robot is not set elsewhere; None if it may be."""
        if self._is_recording:
            return Answer(False, _RECORDED.format(what), 'recording')
        if self.drives_by_itself:
            return Answer(False, _TRYING.format(what), 'trying')
        return None

    async def _set_back(self) -> Answer:
        """Set a simulated robot back to the start."""
        if refusal := self._refusal('set the robot back'):
            return refusal
        simulated = await self._services.is_simulated()
        if simulated is None:
            return Answer(False, absence(self._services.learner), NO_LEARNER)
        if not simulated:
            return Answer(
                False, 'a real robot is not set back: drive it back by the keys', 'real_robot')
        return await self._placement.set_to_start(self._status.start)

    async def _teach_here(self, x: float | None = None, y: float | None = None) -> Answer:
        """
        Set a simulated robot to where to teach next; of a real one say where that is.

        ``x`` and ``y`` are a place that somebody has chosen, [m].
        """
        if refusal := self._refusal('set the robot elsewhere'):
            return refusal
        simulated = await self._services.is_simulated()
        if simulated is None:
            return Answer(False, absence(self._services.learner), NO_LEARNER)
        if not simulated:
            return where_to_teach(self._status.teach_here)
        if x is not None and y is not None:
            return await self._placement.set_to_place(x, y)
        return await self._placement.set_to_next(self._status.teach_here)

    async def _run_trials(self, **values: Any) -> Answer:
        """Run trials; who stops meanwhile may have been quicker, and is to be right."""
        n_stops = self._n_stops
        answer = await self._ask_for_trials(values)
        if self._n_stops == n_stops or not answer.success:
            return answer
        return await self._end_trials()

    async def _ask_for_trials(self, values: Mapping[str, Any]) -> Answer:
        """Ask for trials; with a real robot for one, from where it was put."""
        if await self._services.is_simulated():
            return await self._services.ask('run_trials', **values)
        if self._is_recording:
            # The controller does not know of it, and what it drives would be recorded.
            return Answer(False, _RECORDED.format('run a trial'), 'recording')
        return await self._services.ask('start_trial')

    async def _stop(self) -> Answer:
        if not self.drives_by_itself:
            return Answer(True, 'the robot stands')
        ended = await self._end_trials()
        return ended._replace(message=ended.message or 'the robot stands')

    async def _end_trials(self) -> Answer:
        """
        End the trial under way and the series it belongs to, and say what was done.

        Both are asked whatever is known of them: a trial may just have been started. The
        controller comes first, so that the robot stands; and again where the learner's next trial
        was quicker than its answer.
        """
        drives = self.drives_by_itself
        self._n_stops += 1
        if drives:
            self._commands.halt()
        stopped = await self._services.ask('stop_trial', patience=_STOP_PATIENCE)
        ended = await self._services.ask('stop_trials', patience=_STOP_PATIENCE)
        if self._status.is_trying and not stopped.success:
            stopped = await self._services.ask('stop_trial', patience=_STOP_PATIENCE)
        if self._status.is_trying and not stopped.success:
            return Answer(False, f'the trial may go on: {stopped.message}', 'may_go_on')
        said = [answer.message for answer in (stopped, ended) if answer.success]
        return Answer(True, '; '.join(said) if drives or ended.success else '')

    async def _quit(self) -> Answer:
        """End the program, once nothing drives on that nobody would watch."""
        try:
            ended = await self.leave()
        finally:
            self.has_quit = True
        return Answer(True, ended.message or 'good bye')

    async def leave(self) -> Answer:
        """End trial and series before nobody watches them; say what stays under way."""
        ended = await self._end_trials()
        if not self._is_recording:
            return ended
        return ended._replace(message='; '.join(filter(None, (ended.message, _STAYS))))
