"""Why there is no odometry to record: none arrives, or what arrives stands still in time."""

import math
from typing import Final

from control_field.watch import Freshness
from learner_node.settings import Settings

#: Stamps that have not advanced for so long do not advance, [s].
_STANDING: Final = 1.0


class Absence:
    """Looks at when odometry arrives, and whether its stamps advance."""

    def __init__(self) -> None:
        """Start with nothing arrived."""
        self._odometry = Freshness(math.inf)
        self._stamp = -math.inf
        self._advanced = -math.inf

    def saw(self, stamp: float, now: float) -> None:
        """Take in an odometry; a clock that is set back advances from there on."""
        if stamp != self._stamp:
            self._stamp, self._advanced = stamp, now
        self._odometry.saw(now)

    def of_odometry(self, now: float, settings: Settings) -> str:
        """Say why a drive could not be recorded; empty if it could be."""
        self._odometry.timeout = math.inf if settings.lockstep else settings.peer_timeout
        if self._odometry.is_stale(now) or not self._odometry.has_come:
            return self._odometry.absence(now, 'odometry')
        if not settings.lockstep and self._odometry.arrived - self._advanced > _STANDING:
            return (f'odometry arrives but does not count: its stamps do not advance (last '
                    f'{self._stamp:.2f} s)')
        return ''
