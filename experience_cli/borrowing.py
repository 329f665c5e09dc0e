"""Bags of other recorders for commands that look into bags of ours: taken over for a moment."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import re
import shlex
import sys
from tempfile import TemporaryDirectory
from typing import Any

from experience_cli.commands import learn_import as external
from experience_cli.errors import UserError


@contextmanager
def bag_of(arguments: argparse.Namespace, command: str) -> Iterator[Any]:
    """
    Give the bag that a person names, which may be one of another recorder; as `EpisodeFolder`.

    Raises
    ------
    UserError, BagError
        If there is none, it cannot be read, or, of another recorder, teaches nothing.

    """
    from experience_cli.bag_argument import find_readable_bag

    path = Path(arguments.bag)
    if is_borrowed(arguments, path):
        with borrowed(arguments, path, command) as episode:
            yield episode
    else:
        yield find_readable_bag(arguments.bag, arguments.bags)


def is_borrowed(arguments: argparse.Namespace, path: Path) -> bool:
    """
    Tell whether a bag is to be read as one of another recorder.

    Raises
    ------
    UserError
        If options say so of what is no path of a bag.

    """
    from experience_cli.bag_selection import is_external

    option = external.wanted_option(arguments)
    if option and not path.exists():
        raise UserError(f'{option}: says how a bag of another recorder is to be read, and there '
                        f'is no file or folder {path}')
    return bool(option) or is_external(path)


@contextmanager
def borrowed(arguments: argparse.Namespace, path: Path, command: str) -> Iterator[Any]:
    """Take a bag of another recorder over into a folder that is gone in the end; say from what."""
    name = re.sub(r'[^A-Za-z0-9_-]+', '_', path.resolve().stem)[:64]
    with TemporaryDirectory() as folder:
        values = vars(arguments) | {'bags': [path], 'into': Path(folder) / name, 'quiet': True,
                                    'new_task': True}
        [(drive, episode)] = external.take_over(argparse.Namespace(**values))
        topics = ', '.join(f'{topic} ({n})' for topic, n in sorted(drive.recorded.items()))
        whose = (f'{path} is a bag of another recorder, read as `experience learn '
                 f'{shlex.quote(str(path))}` does')
        said = '; '.join([whose, *drive.notes, f'its topics: {topics}'])
        print(f'experience {command}: {said}', file=sys.stderr)
        yield episode
