"""The working process itself: it answers request after request until nobody asks any more."""

from contextlib import suppress
from multiprocessing.connection import Connection
import os
import resource
import signal
import sys
from threading import Thread
import time
import traceback
from typing import Any, Final

from page_node.refusal import RefusedError

#: Most memory of its own, [bytes]: a hostile bag must not take the robot's.
_MOST_MEMORY: Final = 2 * 2**30
#: It gives way to the robot.
_NICENESS: Final = 10
#: How often it looks whether its parent still lives, [s].
_LOOK_EVERY: Final = 0.5


def main() -> None:
    """Answer what comes through the pipe whose number is the first argument."""
    _give_way()
    Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    with Connection(int(sys.argv[1])) as connection, suppress(EOFError, BrokenPipeError):
        while True:
            try:
                request = connection.recv()
            except (EOFError, OSError):
                raise
            except Exception as error:
                connection.send(_mistake(error))
                continue
            _send(connection, _answer(*request))


def _answer(function: Any, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """Return what a function returns, as the only item of a list, or a `RefusedError`."""
    try:
        return [function(*arguments, **named)]
    except RefusedError as refusal:
        return refusal
    except MemoryError:
        return RefusedError('too_large', 'it needs more memory than there is for it', 413)
    except Exception as error:
        return _mistake(error)


def _send(connection: 'Connection[Any, Any]', answer: Any) -> None:
    try:
        connection.send(answer)
    except OSError:
        raise
    except Exception as error:
        connection.send(_mistake(error))


def _mistake(error: Exception) -> RefusedError:
    """Write where a mistake of ours was made; return what the page is told."""
    traceback.print_exception(error)
    return RefusedError('mistake', f'{type(error).__name__}: {error}', 500)


def _give_way() -> None:
    """Take what the node leaves, and end only when it says so, or dies."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICENESS)
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    most = _MOST_MEMORY if hard == resource.RLIM_INFINITY else min(_MOST_MEMORY, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_EVERY)
    os._exit(1)


if __name__ == '__main__':
    main()
