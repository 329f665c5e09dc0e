"""Waiting in the coroutines of a node, but not for ever."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import time
from typing import Any, Final

#: How often it is looked whether something is so, [s].
_POLL_PERIOD: Final = 0.05


class Timeouts:
    """
    Waits in the coroutines of a node, but not for ever.

    Parameters
    ----------
    node : Node
        Whose executor runs them.
    future : callable
        Makes a future of that executor.
    clock : Clock
        A steady one.

    """

    def __init__(self, node: Any, future: Callable[[], Any], clock: Any) -> None:
        """Wait for nothing yet."""
        self._node, self._clock = node, clock
        self.future = future

    @contextmanager
    def repeating(self, period: float, callback: Callable[[], None]) -> Iterator[None]:
        """Call something every so many seconds meanwhile."""
        timer = self._node.create_timer(period, callback, clock=self._clock)
        try:
            yield
        finally:
            self._node.destroy_timer(timer)

    async def within(self, future: Any, seconds: float) -> Any:
        """Return the result of a future, None when that takes longer."""
        with self.repeating(seconds, lambda: future.done() or future.set_result(None)):
            return await future

    async def until(self, predicate: Callable[[], bool], deadline: float) -> bool:
        """Return True once something is so; False after a deadline, [s] on a steady clock."""
        while not predicate():
            if time.monotonic() > deadline:
                return False
            await self.within(self.future(), _POLL_PERIOD)
        return True
