"""
The command `experience`.

Every subcommand is a module of this package with two functions: ``add_parser(subparsers)``, which
is cheap, and ``run(arguments) -> int``, which imports what it needs. It is added to `COMMANDS`.
"""

import argparse
from collections.abc import Sequence
import importlib
import os
import sys
from typing import Final, NoReturn

from experience_cli.errors import UserError
from msgs_bridge.bag_folder import BagError
from msgs_bridge.processes import prepare

#: Modules of the subcommands, in the order of the help.
COMMANDS: Final = (
    'demo', 'learn', 'evaluate', 'inspection', 'explain', 'diff', 'list_command', 'show', 'label',
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
        prog='experience', description='Teach a robot by driving it once, and let it try.')
    subparsers = top.add_subparsers(dest='command', metavar='COMMAND', required=True)
    for name in COMMANDS:
        module = importlib.import_module(f'experience_cli.{name}')
        module.add_parser(subparsers).set_defaults(run=module.run)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run a subcommand.

    Returns
    -------
    int
        0 if all is well, 1 if it did not come to what it should, 2 after one line on stderr if
        the user made a mistake, 130 after Ctrl-C.

    """
    prepare()
    parsed = parser().parse_args(arguments)
    try:
        return int(parsed.run(parsed))
    except (UserError, BagError) as error:
        print(f'experience {parsed.command}:', ' '.join(str(error).split()), file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f'experience {parsed.command}: stopped', file=sys.stderr)
        return 130
    except BrokenPipeError:
        # Whoever read the output has seen enough; nothing may complain at the exit either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        # A path that cannot even be looked at: no permission, too long, a disk that fails.
        said = f'cannot use {error.filename or "a file"}: {(error.strerror or str(error)).lower()}'
        print(f'experience {parsed.command}:', ' '.join(said.split()), file=sys.stderr)
        return 2


if __name__ == '__main__':
    raise SystemExit(main())
