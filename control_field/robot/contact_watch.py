"""Whether something has run into the robot while it stood, and for how long it may."""

from typing import Final

from control_field.robot.patience import Patience

#: How long nothing must have touched the robot before it drives on, [s].
_CALM: Final = 0.5


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
        self.is_touched = self._touches = False
        self._calm = Patience(_CALM)
        self._patience = Patience(timeout)

    @property
    def timeout(self) -> float:
        """Return how long a contact may last, [s]."""
        return self._patience.seconds

    @timeout.setter
    def timeout(self, seconds: float) -> None:
        self._patience.seconds = seconds

    def forget(self) -> None:
        """Begin a trial: what touched the robot before is nobody's fault."""
        self.is_touched = self._touches = False

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
        if self._touches:
            self._calm.lasts(stamp, None)
        elif not self._calm.lasts(stamp, 'calm'):
            self.is_touched = False
        return not self._patience.lasts(stamp, 'touched' if self.is_touched else None) and (
            self.is_touched)
