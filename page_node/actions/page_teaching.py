"""Teaching from the page: what keys do, and trials of a real robot one after the other."""

from collections.abc import Callable, Mapping
import time
from typing import Any, Final

from control_field.robot.limits import Velocity
from control_field.robot.stop_reasons import StopReason
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.actions import Action
from msgs_bridge.teaching.answers import Answer
from msgs_bridge.teaching.teaching import Teaching
from page_node.actions.wanted import ACTIONS, SET_SPEEDS, Wanted

#: Who stops a trial wants no other.
_ENDS_SERIES: Final = (StopReason.ASKED, StopReason.NO_HEARTBEAT, StopReason.SHUTDOWN)
#: Time that a trial takes to begin, [s].
_BEGINNING: Final = 3.0
#: What is done before more trials of a real robot: they are wanted no more.
_OTHER_PLANS: Final = (Action.STOP, Action.START)


class PageTeaching:
    """
    Carries out what the page asks for.

    A real robot has to be driven back after each trial, so that the next one of several waits for
    somebody to press the button again.

    Parameters
    ----------
    teaching : Teaching
    is_simulated : callable
        Returns whether the robot is set back by itself.
    set_speeds : callable
        Sets the speeds of a full push, [m/s] and [rad/s].

    """

    def __init__(
        self, teaching: Teaching, is_simulated: Callable[[], bool],
        set_speeds: Callable[[Velocity], Answer],
    ) -> None:
        """Start with nothing begun."""
        self.tries_left = 0  #: trials of a real robot that are yet wanted
        self._teaching, self._is_simulated = teaching, is_simulated
        self._set_speeds = set_speeds
        self._begun_at: float | None = None

    async def perform(self, wanted: Wanted) -> Answer:
        """Carry it out."""
        if wanted.name == SET_SPEEDS:
            return self._set_speeds((wanted.values['v'], wanted.values['w']))
        action = ACTIONS[wanted.name]
        if action in _OTHER_PLANS:
            self.tries_left = 0
        if action is Action.RUN_TRIALS:
            return await self._run_trials(wanted.values)
        return await self._teaching.perform(action, **wanted.values)

    async def _run_trials(self, values: Mapping[str, Any]) -> Answer:
        """Run trials; of a real robot the first of them."""
        is_simulated = self._is_simulated()
        answer = await self._teaching.perform(
            Action.RUN_TRIALS, **(values if is_simulated else {}))
        if answer.success:
            self._begun_at = time.monotonic()
            wanted = int(values.get('n', 1))
            self.tries_left = 0 if is_simulated else max(wanted, self.tries_left) - 1
        return answer

    def on_trial(self, trial: TrialStatus) -> None:
        """Note how a trial stands: who has stopped it wants no more."""
        if trial.state is State.ENDED and trial.stop_reason in _ENDS_SERIES:
            self.tries_left = 0

    def look(self) -> None:
        """Forget what was begun here once it is over: what is begun then is somebody else's."""
        is_over = not self._teaching.drives_by_itself
        if self._begun_at is not None and is_over and (
                time.monotonic() - self._begun_at > _BEGINNING):
            self._begun_at = None

    async def leave(self) -> Answer:
        """End what was begun here, before nobody watches it."""
        if self._begun_at is None:
            return Answer(True, '')
        return await self._teaching.leave()
