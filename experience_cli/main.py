"""The command `experience`: its arguments are read, then the module of the command is imported."""

import argparse
from collections.abc import Sequence
from contextlib import suppress
import errno
import importlib
import io
import os
from pathlib import Path
import sys
from typing import NoReturn

from episode_store.rosbag2.errors import BagError
from experience_cli.arguments import COMMANDS, parser
from experience_cli.errors import UserError
from experience_cli.interrupts import stoppable, Stopped
from msgs_bridge.node.environment import folder_without_home, has_home, prepare
from msgs_bridge.untrusted.text import safe_output


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run a subcommand.

    Returns
    -------
    int
        0 if all is well, 1 if it did not come to what it should, 2 after one line on stderr if
        the user made a mistake, 130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP.

    """
    prepare()
    _prepare_output()
    _prepare_drawing()
    try:
        with safe_output():
            return _run(parser().parse_args(arguments), arguments is None)
    finally:
        # Python would print an error at the exit where what is left cannot be written.
        try:
            sys.stdout.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _prepare_output() -> None:
    """Let any text be written, and discard it where the parent has closed the output."""
    for name in ('stdout', 'stderr'):
        if getattr(sys, name) is None:
            # It stays open to the end, and takes the number that is free: no bag will get it.
            setattr(sys, name, Path(os.devnull).open('w'))  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Not every name of a file is text.
        sys.stdout.reconfigure(errors='backslashreplace')


def _prepare_drawing() -> None:
    """Let matplotlib draw into files only, whatever the environment says of screens and homes."""
    os.environ['MPLBACKEND'] = 'agg'
    if not os.environ.get('MPLCONFIGDIR') and not has_home('.config'):
        os.environ['MPLCONFIGDIR'] = str(folder_without_home())


def _run(parsed: argparse.Namespace, on_command_line: bool) -> int:
    """Run a subcommand; return its exit code, or that of what went wrong."""
    try:
        with stoppable(on_command_line):
            module = COMMANDS[parsed.command].module
            code = int(importlib.import_module(f'experience_cli.commands.{module}').run(parsed))
        sys.stdout.flush()
        return code
    except (UserError, BagError) as error:
        return _refuse(parsed, str(error))
    except KeyboardInterrupt as error:
        print(f'experience {parsed.command}: stopped', file=sys.stderr)
        code = error.exit_code if isinstance(error, Stopped) else 130
        if on_command_line:
            _leave(code)
        return code
    except BrokenPipeError:
        # Whoever read the output has seen enough.
        return 0
    except OSError as error:
        # A path that cannot even be looked at: no permission, too long, a disk that fails.
        return _refuse(parsed, f'cannot use {error.filename or "a file"}: '
                               f'{(error.strerror or str(error)).lower()}')
    except RuntimeError as error:
        # Before Python 3.13 pathlib makes one of links that lead in a circle.
        cause = error.__context__
        if not isinstance(cause, OSError) or cause.errno != errno.ELOOP:
            raise
        return _refuse(parsed, f'links lead in a circle: {cause.filename!r}')


def _leave(code: int) -> NoReturn:
    """Exit without finalising what was interrupted midway: some libraries fail at that."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            stream.flush()
    os._exit(code)


def _refuse(parsed: argparse.Namespace, why: str) -> int:
    """Print in one line what the user got wrong; return the exit code."""
    print(f'experience {parsed.command}:', ' '.join(why.split()), file=sys.stderr)
    return 2


if __name__ == '__main__':
    raise SystemExit(main())
