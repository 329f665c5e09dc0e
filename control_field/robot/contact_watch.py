"""Whether something has run into the robot while it stood, and for how long it may."""

from typing import Final

from control_field.robot.patience import LONGEST_GAP, Patience

#: How long nothing must have touched the robot before it drives on, and before what touched it
#: is over for good, [s]: what comes and comes again lasts.
_CALM: Final = 0.5
_OVER: Final = 2.0


class ContactWatch:
    """
    Keeps the robot standing that something has run into, until that is gone.

    Parameters
    ----------
    timeout : float, [s]
        How long it may last; 0: not at all.

    Attributes
    ----------
    is_touched : bool
        Whether something has run into the standing robot, and is not gone for long enough.

    """

    def __init__(self, timeout: float) -> None:
        """Start with nothing near."""
        self.timeout = timeout
        self.forget()

    def forget(self) -> None:
        """Begin a trial: what touched the robot before is nobody's fault."""
        self.is_touched = self._touches = False
        self._lasted = self._last = 0.0
        self._calm, self._over = Patience(_CALM), Patience(_OVER)

    def on_contact(self, touches: bool, stands: bool) -> bool:
        """Take in what a bumper says; return whether the robot has run into something."""
        self._touches = touches
        if not touches:
            return False
        if not self.is_touched and (not stands or not self.timeout):
            return True
        self.is_touched = True
        return False

    def lasts_too_long(self, stamp: float) -> bool:
        """Take in the time of a pose, [s]; return whether something has touched for too long."""
        what = None if self._touches else 'nothing'
        is_calm, is_over = not self._calm.lasts(stamp, what), not self._over.lasts(stamp, what)
        if what and is_calm:
            self.is_touched = False
        if what and is_over:
            self._lasted = 0.0
        if self.is_touched:
            self._lasted += min(max(stamp - self._last, 0.0), LONGEST_GAP)
        self._last = stamp
        return self.is_touched and self._lasted > self.timeout
