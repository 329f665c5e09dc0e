"""The trial that somebody runs while a demonstration is recorded."""

from typing import Final

from learner_node.session.inputs import is_running
from learner_node.session.phases import SessionError
from msgs_bridge.messages.trial_status import TrialStatus

#: Ticks after which a trial that was heard of during a demonstration is no late word of one that
#: has ended: the word of its end would have come.
_LASTING: Final = 3


class Intruder:
    """
    Finds the trial that somebody runs while a demonstration is recorded.

    What the robot drives then is not what a person shows. A trial that had ended before the
    demonstration began is none, however late it is heard of.
    """

    def __init__(self) -> None:
        """Start with none."""
        self._since = 0.0
        self._has_run = False
        self._n_ticks = 0

    @property
    def is_there(self) -> bool:
        """Whether a trial has run since the demonstration began, for sure."""
        return self._has_run or self._n_ticks >= _LASTING

    def begin(self, status: TrialStatus | None, stamp: float, controller: str) -> None:
        """
        Begin to look for one, because a demonstration is to begin.

        Parameters
        ----------
        status : TrialStatus or None
            Newest word of the controller.
        stamp : float, [s]
            Of the newest odometry.
        controller : str
            Its name.

        Raises
        ------
        SessionError
            If a trial is still running.

        """
        if is_running(status):
            raise SessionError(f'cannot record a demonstration now: trial {status.trial} is still '
                               f'{status.state}, stop it ({controller}/stop_trial)', 'trying')
        self._since, self._has_run, self._n_ticks = stamp, False, 0

    def on_status(self, status: TrialStatus, before: TrialStatus | None) -> None:
        """Note whether the stamps show that a trial runs, or ran until now."""
        ran = is_running(status) or (is_running(before) and before.trial == status.trial)
        self._has_run |= ran and status.stamp > self._since

    def tick(self, status: TrialStatus | None) -> None:
        """Count how long a trial goes on, whatever its stamps say."""
        self._n_ticks = self._n_ticks + 1 if is_running(status) else 0
