"""
Ctrl-C while Python is still starting: one line instead of a page, from the first moment on.

A KeyboardInterrupt in the middle of an import is a traceback at best; where an extension is being
loaded it becomes an ImportError, or nothing. Until a command is ready to end properly, Ctrl-C ends
the process at once: with a line and code 130, of a node with 0 and without a word. So do SIGTERM
(143) and SIGHUP (129).

`tools/setup.sh` lets a virtual environment import this before anything else, for the packages in
it take a tenth of a second before our first line; that is why only what is compiled into Python
is imported here. It heeds only processes that run our commands.
"""

import _signal as signals  # type: ignore[import-not-found]
from posix import _exit, environ, write
import sys

_COMMAND = 'experience'
_BOOTSTRAP = '/ros_wheels_bootstrapper.pth'
_ENDING = (signals.SIGINT, signals.SIGTERM)


def ours(arguments: list[str]) -> str | None:
    """
    Return which of our programs an interpreter was started for.

    Parameters
    ----------
    arguments : list of str
        The interpreter and what stands behind it.

    Returns
    -------
    str or None
        ``experience``, with its subcommand if there is one, or the name of a node.

    """
    rest = arguments[1:]
    while rest and rest[0].startswith('-') and rest[0] != '-m':
        rest = rest[2:] if rest[0] in ('-X', '-W') else rest[1:]
    is_module = rest[:1] == ['-m']
    name, *more = (rest[1:] if is_module else rest) or ['']
    if is_module:
        program = _COMMAND if name == 'experience_cli.main' else (
            name.removesuffix('.node').split('.')[-1])
        known = name == 'experience_cli.main' or name.endswith('_node.node')
    else:
        *folders, program = name.split('/')
        known = folders[-1:] in (['bin'], ['experience_controller']) and (
            program == _COMMAND or program.endswith('_node'))
    if not known:
        return None
    return ' '.join([program, *more[:1]]) if (
        program == _COMMAND and more and more[0].isalpha()) else program


def end_at_once(program: str) -> None:
    """Let Ctrl-C and the like end the process; what a shell has ignored stays ignored."""
    def end(number: int, frame: object) -> None:
        try:
            if program.startswith(_COMMAND):
                write(2, f'{program}: stopped\n'.encode())
        except OSError:
            pass  # nobody is left to hear it
        finally:
            _exit(128 + number if program.startswith(_COMMAND) else 0)

    for number in (*_ENDING, signals.SIGHUP):
        if signals.getsignal(number) is not signals.SIG_IGN:
            signals.signal(number, end)


def _begin() -> None:
    program = ours(sys.orig_argv)
    if program is None:
        return
    end_at_once(program)
    if b'_ROS_WHEELS_BOOTSTRAP_COMPLETE' in environ or not _is_there(_BOOTSTRAP):
        signals.pthread_sigmask(signals.SIG_UNBLOCK, _ENDING)
    else:
        # The wheels of ROS start the interpreter anew; signals wait until that one is here.
        signals.pthread_sigmask(signals.SIG_BLOCK, _ENDING)


def _is_there(name: str) -> bool:
    try:
        with open(__file__.rpartition('/')[0] + name):  # noqa: PTH123 - pathlib takes 15 ms
            return True
    except OSError:
        return False


_begin()
