"""
The process that does what takes long: bags are read and fields are learnt there, not in the node.

A room asks it for something with `Worker.ask(function, arguments...)`. The function is one of a
module's own, for it is found by its name there; what it is given and returns is copied. What it
keeps for the next time it keeps in its module, in that process. It raises `RefusedError` where a
person is to be told something.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import subprocess
import sys
from threading import Lock
from typing import Any, Final, ParamSpec, TypeVar

from msgs_bridge.node.environment import child_environment
from page_node.refusal import RefusedError

#: Requests that may wait; one more is refused.
MOST_WAITING: Final = 64
#: How long one may take, unless it says otherwise, [s].
PATIENCE: Final = 30.0
#: How long the process may take to end by itself, [s].
_FAREWELL: Final = 0.5
#: The process works on one core, whatever the libraries would like.
_ONE_CORE: Final = dict.fromkeys(
    ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMBA_NUM_THREADS'), '1')

_Arguments = ParamSpec('_Arguments')
_Result = TypeVar('_Result')


class Worker:
    """
    One process, started at the first request, and anew after it died.

    Requests are done one by one in their order. All methods may be called from any thread.

    Parameters
    ----------
    most_waiting : int
        Requests that may be under way or waiting at once.

    """

    def __init__(self, most_waiting: int = MOST_WAITING) -> None:
        self._most_waiting = most_waiting
        self._n_waiting, self._lock = 0, Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection[Any, Any] | None = None
        self._is_closed = False
        self._thread = ThreadPoolExecutor(1, 'worker')

    async def ask(self, function: Callable[_Arguments, _Result], *arguments: _Arguments.args,
                  **named: _Arguments.kwargs) -> _Result:
        """
        Have a function called in the process; return what it returns.

        Who is cancelled while it waits for its turn gives that up.

        Raises
        ------
        RefusedError
            As the function does; ``busy`` if too many wait, ``too_long`` if it took more than
            `PATIENCE`, ``died`` if a new process was lost with it, ``mistake`` for what should not
            be (the process has then written where).

        """
        return await asyncio.wrap_future(self.submit(PATIENCE, function, *arguments, **named))

    def submit(self, patience: float, function: Callable[_Arguments, _Result],
               *arguments: _Arguments.args, **named: _Arguments.kwargs) -> 'Future[_Result]':
        """Ask for something that may take so long, [s]; see `ask`."""
        with self._lock:
            if self._is_closed or self._n_waiting >= self._most_waiting:
                raise RefusedError('busy', f'{self._n_waiting} requests wait already', 503)
            self._n_waiting += 1
            future = self._thread.submit(self._done, patience, function, arguments, named)
        future.add_done_callback(self._count_down)
        return future

    def close(self) -> None:
        """End the process; who still waits is refused."""
        with self._lock:
            self._is_closed = True
            process = self._process
        self._thread.shutdown(wait=False, cancel_futures=True)
        if process is not None:
            process.terminate()
        self._thread.shutdown()
        self._end()

    @property
    def pid(self) -> int | None:
        """Return the id of the process; None before the first request."""
        return None if self._process is None else self._process.pid

    def _count_down(self, future: 'Future[Any]') -> None:
        with self._lock:
            self._n_waiting -= 1

    def _done(self, patience: float, function: Callable[..., Any], arguments: tuple[Any, ...],
              named: dict[str, Any]) -> Any:
        """
        Have it done; in the thread of this object, the only one that talks to the process.

        A process that was there before may have been dying of something else: then a new one is
        asked.
        """
        while True:
            was_there = self._connection is not None
            try:
                answer = self._exchange(patience, (function, arguments, named))
            except (EOFError, OSError) as error:
                self._end()
                if not was_there:
                    raise RefusedError(
                        'died', f'the working process was lost: {error}', 503) from None
                continue
            if isinstance(answer, RefusedError):
                raise answer
            return answer[0]

    def _exchange(self, patience: float, request: tuple[Any, ...]) -> Any:
        """Send a request to the process, and return its answer."""
        connection = self._ready()
        connection.send(request)
        if not connection.poll(patience):
            self._end()
            raise RefusedError('too_long', f'it took more than {patience:g} s', 503)
        return connection.recv()

    def _ready(self) -> 'Connection[Any, Any]':
        """Return the way to the process, which is started if there is none."""
        if self._connection is not None:
            process = self._process
            if process is not None and process.poll() is None:
                return self._connection
            self._end()
        ours, theirs = Pipe()
        with theirs, self._lock:
            if self._is_closed:
                raise EOFError('the node ends')
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'page_node.memory.worker_process', str(theirs.fileno())],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, pass_fds=[theirs.fileno()],
                env=child_environment(_ONE_CORE), start_new_session=True)
        self._connection = ours
        return ours

    def _end(self) -> None:
        """Be rid of the process, if there is one."""
        if self._connection is not None:
            self._connection.close()
        if self._process is not None:
            try:
                self._process.wait(_FAREWELL)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._connection = self._process = None
