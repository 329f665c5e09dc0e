"""Requests to stop a trial of whose end nothing is heard."""

import math


class UnheardStop:
    """
    Requests to stop a trial of whose end nothing is heard.

    A controller that gets one ends the trial at once, and says so. If nothing comes the trial may
    be over for long: nodes that were suspended one after the other may not find each other again.

    Attributes
    ----------
    problem : str
        Who does not answer, for how long at least, and what to do; empty until that has lasted.

    """

    def __init__(self) -> None:
        """Start with none made."""
        self.problem = ''
        self._since = math.inf
        self._answer = ''

    def reset(self) -> None:
        """Note that the controller was heard, or that there is nothing to stop."""
        self.problem, self._since, self._answer = '', math.inf, ''

    def on_made(self, now: float) -> None:
        """Note a request."""
        self._since = min(self._since, now)

    def on_answer(self, message: str) -> None:
        """Note what the controller answered."""
        if self._since < math.inf:
            self._answer = message

    def on_suspended(self, seconds: float, now: float) -> None:
        """Count the time during which this process was suspended out."""
        self._since = min(self._since + seconds, max(self._since, now))

    def has_lasted(self, seconds: float, now: float) -> bool:
        """Return whether the first request was made longer ago than that."""
        return now - self._since > seconds

    def explain(self, trial: int, controller: str, seconds: float) -> None:
        """Set the problem, after so many seconds in which a trial's end was not heard."""
        remedy = ('start learner_node anew, which loses nothing that was learnt; if that does not '
                  f'help, {controller}')
        self.problem = (
            f'{controller} answers to stop_trial "{self._answer}", but its word of how trial '
            f'{trial} ended has not come for {seconds:g} s: {remedy}' if self._answer else
            f'{controller} has not answered stop_trial for {seconds:g} s, and trial {trial} may '
            f'be over: {remedy}')
