"""What the server asks of ROS: coroutines that run where the node runs."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

from page_node.refusal import RefusedError

Result = TypeVar('Result')


class RosTasks:
    """
    Runs coroutines in the executor of a node, for whoever awaits them in another event loop.

    Parameters
    ----------
    node : Node
        Whose executor it is.

    """

    def __init__(self, node: Any) -> None:
        """Run nothing yet."""
        self._node = node

    def begin(self, work: Callable[[], Awaitable[Any]]) -> None:
        """Run a coroutine that nobody waits for; any thread may call."""
        self._create(work, lambda result, error: None)

    async def do(self, work: Callable[[], Awaitable[Result]]) -> Result:
        """
        Run a coroutine and return its result, or raise its error, in the caller's event loop.

        Raises
        ------
        RefusedError
            If the node does not run, yet or any more.

        """
        loop = asyncio.get_running_loop()
        future: asyncio.Future[Result] = loop.create_future()

        def settle(result: Any, error: Exception | None) -> None:
            if future.done():
                return  # the browser has gone away meanwhile
            if error is None:
                future.set_result(result)
            else:
                future.set_exception(error)

        self._create(work, lambda *found: loop.call_soon_threadsafe(settle, *found))
        return await future

    def _create(
        self, work: Callable[[], Awaitable[Any]],
        then: Callable[[Any, Exception | None], Any],
    ) -> None:
        async def run() -> None:
            try:
                result = await work()
            except Exception as error:
                then(None, error)
            else:
                then(result, None)

        executor = self._node.executor
        if executor is None:
            raise RefusedError('not_running', 'page_node is starting or ending: try again', 503)
        executor.create_task(run)
