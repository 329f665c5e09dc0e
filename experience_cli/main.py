"""
The command `experience`.

Every subcommand is a module of `commands` with two functions: ``add_parser(subparsers)``, which
is cheap, and ``run(arguments) -> int``, which imports what it needs. It is added to `COMMANDS`.
"""

import argparse
from collections.abc import Sequence
from contextlib import suppress
import importlib
import io
import os
from pathlib import Path
import sys
from typing import Final, NoReturn

from episode_store.rosbag2.errors import BagError
from experience_cli.errors import UserError
from experience_cli.interrupts import heard, Stopped
from msgs_bridge.node.environment import folder_without_home, has_home, prepare
from msgs_bridge.untrusted.text import safe_output

#: Modules of the subcommands, in the order of the help.
COMMANDS: Final = (
    'demo', 'learn', 'evaluate', 'inspect_field', 'explain', 'diff', 'list_bags', 'show', 'label',
    'trim', 'forget', 'repair')


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        """End with exit code 2."""
        line = ' '.join(message.split())
        self.exit(2, f'{self.prog}: {line} (see {self.prog} --help)\n')


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    top = Parser(
        prog='experience', description='Teach a robot by driving it once, and let it try.',
        epilog='A bag is one recording: of a drive of yours (demo) or of a try of the robot '
        '(trial). bags/kitchen holds those of the task kitchen; kitchen/0002 names one of them. '
        'A field says which way the robot goes from every place.')
    subparsers = top.add_subparsers(dest='command', metavar='COMMAND', required=True)
    for name in COMMANDS:
        module = importlib.import_module(f'experience_cli.commands.{name}')
        module.add_parser(subparsers).set_defaults(run=module.run)
    return top


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
        # What is still to be written and cannot be would be complained of at the exit.
        try:
            sys.stdout.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _prepare_output() -> None:
    """Let any text be written, and none where whoever started this has closed the output."""
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
        with heard(on_command_line):
            code = int(parsed.run(parsed))
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
        # What pathlib says of links that lead in a circle, before Python 3.13.
        if not str(error).startswith('Symlink loop'):
            raise
        return _refuse(parsed, str(error).replace('Symlink loop from', 'links lead in a circle:'))


def _leave(code: int) -> NoReturn:
    """End without taking things down that were stopped midway: some of them do not bear it."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            stream.flush()
    os._exit(code)


def _refuse(parsed: argparse.Namespace, why: str) -> int:
    """Say in one line what the user got wrong; return the exit code."""
    print(f'experience {parsed.command}:', ' '.join(why.split()), file=sys.stderr)
    return 2


if __name__ == '__main__':
    raise SystemExit(main())
