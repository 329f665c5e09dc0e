"""Which tick of a lock-step is open: both its messages have arrived, and no answer is sent."""

from typing import Any

Stamp = tuple[int, int]


def key_of(msg: Any) -> Stamp:
    """Return the stamp of a message as numbers that compare exactly."""
    return msg.header.stamp.sec, msg.header.stamp.nanosec


class TickBook:
    """
    Keeps what has arrived of a tick, in either order, and whether it is answered.

    Attributes
    ----------
    odometry, local_grid : message or None
        The newest of each.
    owes_stop : bool
        Whether a standstill could not be sent because the tick was answered already: the next one
        must be answered with it.

    """

    def __init__(self) -> None:
        """Start with nothing."""
        self.odometry: Any = None
        self.local_grid: Any = None
        self.owes_stop = False
        self._answered: Stamp | None = None

    def is_answered(self, msg: Any) -> bool:
        """Return whether the tick of a message has been answered."""
        return key_of(msg) == self._answered

    def is_newer(self, msg: Any) -> bool:
        """Return whether odometry is of a tick after the last one."""
        return self.odometry is None or key_of(msg) > key_of(self.odometry)

    def is_open(self) -> bool:
        """Return whether there is a tick to answer."""
        return (self.odometry is not None and self.local_grid is not None
                and key_of(self.odometry) == key_of(self.local_grid)
                and not self.is_answered(self.odometry))

    def mark_answered(self, msg: Any) -> None:
        """Note that the tick of a message is answered now."""
        self._answered = key_of(msg)
        self.owes_stop = False
