"""A thread beside the executor's for what takes long: reading bags and learning."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from threading import Thread
import traceback
from typing import Any

from episode_store.rosbag2.errors import BagError

Job = Callable[[], Any]
Done = Callable[['Future[Any]'], None]


def result_of(future: 'Future[Any]', log: Callable[[str], object]) -> Any:
    """
    Return what a job came to.

    Parameters
    ----------
    future : Future
        That has finished.
    log : callable
        Is told where a mistake of ours was made.

    Raises
    ------
    BagError
        If it failed, be it by a mistake of ours: what the learner holds and records is kept.

    """
    try:
        return future.result()
    except BagError:
        raise
    except Exception as error:
        log(''.join(traceback.format_exception(error)))
        raise BagError(f'a mistake in the learner, please report it: {type(error).__name__}: '
                       f'{error}') from None


class BackgroundWorker:
    """Does jobs one by one, and hands their results to the thread that collects them."""

    def __init__(self) -> None:
        #: Called from the worker's thread when a result waits to be collected.
        self.wake: Callable[[], None] = lambda: None
        self._jobs: SimpleQueue[tuple[Job, Done] | None] = SimpleQueue()
        self._results: deque[tuple[Done, Future[Any]]] = deque()
        self._thread = Thread(target=self._work, name='learner', daemon=True)
        self._thread.start()

    def do(self, job: Job, done: Done) -> None:
        """Do a job in the worker's thread; `collect` calls ``done`` with its future."""
        self._jobs.put((job, done))

    def collect(self) -> None:
        """Call ``done`` for every job that has finished."""
        while self._results:
            done, future = self._results.popleft()
            done(future)

    def close(self, patience: float) -> bool:
        """Wait for the jobs that are queued, [s]; return True if all of them are done."""
        self._jobs.put(None)
        self._thread.join(patience)
        self.wake = lambda: None  # who is still at work has nobody left to wake
        return not self._thread.is_alive()

    def _work(self) -> None:
        while (task := self._jobs.get()) is not None:
            job, done = task
            future: Future[Any] = Future()
            try:
                future.set_result(job())
            except Exception as error:
                future.set_exception(error)
            self._results.append((done, future))
            self.wake()
