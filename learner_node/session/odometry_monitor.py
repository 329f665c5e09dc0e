"""Why a drive cannot be recorded: no odometry arrives, or what arrives does not count."""

import math
from typing import Final

from control_field.robot.stop_rules import Timeout
from control_field.robot.suspension import Suspension
from learner_node.settings import Settings

#: Stamps that have not advanced for so long do not advance, [s].
_STANDING: Final = 1.0
#: So many messages in a row that are no sound poses, or such for so long, [s], are no accident.
_FEW, _SOON = 3, 0.5


class OdometryMonitor:
    """
    Watches when odometry arrives, whether its stamps advance and its poses are sound.

    Parameters
    ----------
    suspension : Suspension
        Of this process.

    """

    def __init__(self, suspension: Suspension) -> None:
        """Start with nothing arrived."""
        self._odometry = Timeout(math.inf, suspension)
        self._stamp = -math.inf
        self._advanced = -math.inf
        self._unsound, self._n_unsound, self._since = '', 0, 0.0

    def on_odometry(self, stamp: float, now: float) -> None:
        """Note an odometry; a clock that is set back advances from there on."""
        if stamp != self._stamp:
            self._stamp, self._advanced = stamp, now
        self._odometry.on_arrival(now)

    def on_sound(self) -> None:
        """Note that something can be learnt from an odometry."""
        self._unsound, self._n_unsound = '', 0

    def on_unsound(self, why: str, now: float) -> None:
        """Note why nothing can be learnt from an odometry."""
        self._unsound, self._n_unsound = why, self._n_unsound + 1
        if self._n_unsound == 1:
            self._since = now

    def lasting_problem(self, now: float, settings: Settings) -> str:
        """Say why a drive cannot be recorded; empty also for what may be a single bad message."""
        is_chance = bool(self._unsound) and self._n_unsound <= _FEW and (
            self._n_unsound == 1 or now - self._since < _SOON)
        return '' if is_chance else self.problem(now, settings)

    def problem(self, now: float, settings: Settings) -> str:
        """Say why a drive cannot be recorded; empty if it can be."""
        self._odometry.timeout = math.inf if settings.lockstep else settings.peer_timeout
        if self._odometry.is_stale(now) or not self._odometry.has_come:
            return self._odometry.absence(now, 'odometry')
        if self._unsound:
            return self._unsound
        if not settings.lockstep and self._odometry.arrived - self._advanced > _STANDING:
            return (f'odometry arrives but does not count: its stamps do not advance (last '
                    f'{self._stamp:.2f} s)')
        return ''
