"""A thread that watches over the dead-man, whatever the server is busy with."""

from collections.abc import Callable
from threading import Condition, Thread
import time
from typing import Final

from control_field.robot.limits import Velocity
from page_node.driving.dead_man import DeadMan, Share, STANDING, Verdict

#: How often it is looked whether a command is over, [s].
_PERIOD: Final = 0.01
#: Time between the same command and its repetition, [s], and of the standstill: the controller
#: brakes by steps, each as long as the time since the last command.
_REPEAT: Final = 0.05
_REPEAT_STANDSTILL: Final = 0.02


class DriveWatch:
    """
    Sends what is driven: at once when it changes, again while it is held, and its end.

    Callers are the server's event loop, the executor of ROS, and the thread of this object; the
    lock is held while a command is sent, so that none overtakes the standstill after it.

    Parameters
    ----------
    send : callable
        Publishes a velocity, (m/s, rad/s); any thread may call it.
    speeds : tuple of float, [m/s] and [rad/s]
        Of a share of 1.

    """

    def __init__(self, send: Callable[[Velocity], None], speeds: Velocity) -> None:
        """Start with nobody driving; `start` starts the thread."""
        self._send, self.speeds = send, speeds
        self._dead_man = DeadMan()
        self._changed = Condition()
        self._last: Share | None = None
        self._due = 0.0
        self._is_over = False
        self._error: BaseException | None = None
        self._thread = Thread(target=self._watch, name='drive_watch', daemon=True)

    def start(self) -> None:
        """Begin to watch."""
        self._thread.start()

    def close(self) -> None:
        """Stand, and end the thread."""
        with self._changed:
            self._dead_man.stop(time.monotonic())
            self._drive()
            self._is_over = True
            self._changed.notify()
        if self._thread.is_alive():
            self._thread.join()

    def join(self) -> int:
        """Return the number of a new link."""
        with self._changed:
            return self._dead_man.join()

    def leave(self, link: int) -> None:
        """Forget a link; what it drives stands."""
        with self._changed:
            self._dead_man.leave(link, time.monotonic())
            self._drive()

    def command(self, link: int, sent: float, share: Share) -> Verdict:
        """Take in a command, `sent` by the browser's clock, [s], and pass it on."""
        with self._changed:
            verdict = self._dead_man.command(link, sent, share, time.monotonic())
            self._drive()
            return verdict

    def halt(self) -> None:
        """Stand, and tell the robot so; who holds something has to let go of it first."""
        with self._changed:
            self._dead_man.stop(time.monotonic())
            self._drive()

    def let_go(self) -> None:
        """Stop driving; who does not drive stays silent, and takes no trial over."""
        if self.is_driving:
            self.halt()

    @property
    def driver(self) -> int | None:
        """Return the link that drives."""
        with self._changed:
            return self._dead_man.driver(time.monotonic())

    @property
    def is_driving(self) -> bool:
        """Whether commands are sent."""
        with self._changed:
            return self._dead_man.share(time.monotonic()) is not None

    def _drive(self) -> None:
        """Send what is due; the caller holds the lock."""
        now = time.monotonic()
        share = self._dead_man.share(now)
        if share is None:
            self._last = None
            return
        if share != self._last or now >= self._due:
            # In step with the last one, so that the rate holds on average.
            period = _REPEAT_STANDSTILL if share == STANDING else _REPEAT
            is_new = share != self._last
            self._due = now + period if is_new else max(self._due, now - period) + period
            if self._last is None:
                self._changed.notify()  # the thread sleeps while nobody drives
            self._last = share
            self._send((share[0] * self.speeds[0], share[1] * self.speeds[1]))

    def check(self) -> None:
        """Raise what has ended the thread."""
        if self._error is not None:
            raise self._error

    def _watch(self) -> None:
        try:
            with self._changed:
                while not self._is_over:
                    self._drive()
                    self._changed.wait(None if self._last is None else _PERIOD)
        except BaseException as error:
            self._error = error


