"""Which tick of a lock-step is open: both its messages are there, and nobody has answered it."""

from typing import Any

Stamp = tuple[int, int]


def key_of(msg: Any) -> Stamp:
    """Return the stamp of a message as numbers that compare exactly."""
    return msg.header.stamp.sec, msg.header.stamp.nanosec


class TickBook:
    """
    Keeps what has arrived of a tick, in either order, and that it is answered exactly once.

    Attributes
    ----------
    odometry, local grid : message or None
        The newest of each.
    owes_stop : bool
        Whether a standstill could not go out because the tick was answered already: the next one
        has to be answered with it.

    """

    def __init__(self) -> None:
        """Start with nothing."""
        self.odometry: Any = None
        self.local_grid: Any = None
        self.owes_stop = False
        self._answered: Stamp | None = None

    def is_answered(self, msg: Any) -> bool:
        """Tell whether the tick of a message has been answered."""
        return key_of(msg) == self._answered

    def is_newer(self, msg: Any) -> bool:
        """Tell whether odometry is of a tick after the last one."""
        return self.odometry is None or key_of(msg) > key_of(self.odometry)

    def is_open(self) -> bool:
        """Tell whether there is a tick to answer."""
        return (self.odometry is not None and self.local_grid is not None
                and key_of(self.odometry) == key_of(self.local_grid)
                and not self.is_answered(self.odometry))

    def answer(self, msg: Any, is_stop: bool) -> bool:
        """Note that the tick of a message is answered now; False if it was before."""
        if self.is_answered(msg):
            self.owes_stop = is_stop
            return False
        self._answered = key_of(msg)
        self.owes_stop = False
        return True
