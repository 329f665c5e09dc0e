"""What the terminal shows: a status line, and above it what was said."""

from collections.abc import Callable

from msgs_bridge.node.throttled_log import LogRateLimiter
from teleop_node.status_line import line_over, message_over
from teleop_node.terminal import Terminal


class Screen:
    """
    Shows a line that is written over, and messages that stay; without a terminal it logs them.

    Parameters
    ----------
    terminal : Terminal or None
    line : callable
        Returns the status line, no wider than so many columns.
    log : callable
        Logs a message.

    """

    def __init__(
        self, terminal: Terminal | None, line: Callable[[int], str], log: Callable[[str], object],
    ) -> None:
        """Show nothing yet."""
        self._terminal = terminal
        self._line = line
        self._log = log
        self._rate_limiter = LogRateLimiter()

    def refresh(self) -> None:
        """Write the status line over the last one."""
        if self._terminal is not None:
            self._terminal.write(line_over(self._line(self._terminal.width - 1)))

    def say(self, text: str) -> None:
        """Say something that stays: on the terminal, or in the log where there is none."""
        if self._terminal is None:
            self._log(text)
        elif text := self._rate_limiter.limit(text):
            self._terminal.write(message_over(text))
            self.refresh()
