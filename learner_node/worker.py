"""One thread beside the executor's, for what takes long: reading bags and learning."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

Job = Callable[[], Any]
Done = Callable[['Future[Any]'], None]


class Worker:
    """Does jobs one by one, and hands their results to the thread that collects them."""

    def __init__(self) -> None:
        #: Called from the worker's thread when a result waits to be collected.
        self.wake: Callable[[], None] = lambda: None
        self._results: deque[tuple[Done, Future[Any]]] = deque()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix='learner')

    def do(self, job: Job, done: Done) -> None:
        """Do a job in the worker's thread; `collect` calls ``done`` with its future."""
        def finished(future: 'Future[Any]') -> None:
            self._results.append((done, future))
            self.wake()

        self._pool.submit(job).add_done_callback(finished)

    def collect(self) -> None:
        """Call ``done`` for every job that has finished."""
        while self._results:
            done, future = self._results.popleft()
            done(future)

    def close(self) -> None:
        """Let the job under way end, and do no more."""
        self._pool.shutdown(wait=True, cancel_futures=True)
