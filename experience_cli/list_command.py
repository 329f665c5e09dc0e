"""`experience list`: which bags there are, and what became of them."""

import argparse
from collections.abc import Iterator
import json
from pathlib import Path
from typing import Any

from experience_cli.errors import UserError
from experience_cli.references import BAGS

_TITLES = ('bag', 'kind', 'state', 'began', 'seconds', 'messages', 'cells', 'outcome', 'label',
           'size')
_RIGHT = (4, 5, 6, 9)


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Add the command."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        'list', help='say which bags there are',
        description='List the bags of a task, or of all tasks: what each one holds, how it ended, '
        'what a person said of it, and whether it is learnt from.')
    parser.add_argument('folder', nargs='?', type=Path, default=BAGS, metavar='TASK',
                        help='a task, a bag such as task1/0003, or the folder of all tasks '
                        '(%(default)s)')
    parser.add_argument('--json', action='store_true', help='print a JSON list instead')
    return parser


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    from experience_cli.references import named_path
    from experience_cli.summary import summary_of, table_lines

    summaries = [summary_of(episode) for episode in episodes_in(named_path(arguments.folder))]
    if arguments.json:
        print(json.dumps([summary.to_json() for summary in summaries], indent=2))
        return 0
    print('\n'.join(table_lines([_TITLES, *map(_row, summaries)], _RIGHT)))
    for summary in summaries:
        if summary.state in ('cut', 'unreadable', 'not kept', 'aborted', 'incomplete'):
            print(f'{summary.bag}: {summary.note}')
    return 0


def episodes_in(folder: Path) -> Iterator[Any]:
    """
    Go through the bags of a task, or of all tasks in a folder, those forgotten among them.

    Raises
    ------
    UserError
        If there are none.
    BagError
        If one of the folders cannot be read.

    """
    from experience_cli.episodes import is_named_like_ours
    from experience_cli.references import task_folder
    from msgs_bridge.bag_folder import episode_from_path, TaskFolder, tasks

    if not folder.is_dir():
        raise UserError(f'there is no folder {folder}')
    task = task_folder(folder)
    if task is None and is_named_like_ours(folder):
        yield episode_from_path(folder)
        return
    found = [task] if task else [TaskFolder(folder, name) for name in tasks(folder)]
    if not found:
        raise UserError(f'{folder} holds no bags, must be the folder of a task or of all tasks')
    for each in found:
        yield from sorted([*each.episodes(), *each.forgotten()])


def _row(summary: Any) -> tuple[str, ...]:
    from experience_cli.summary import size_text, time_text

    n = summary.cells if summary.steps is None else summary.steps
    return (
        summary.bag, summary.kind, summary.state, time_text(summary.begun),
        '-' if summary.duration is None else f'{summary.duration:.1f}', str(summary.messages),
        '-' if n is None else str(n), summary.outcome or '-', summary.label or '-',
        size_text(summary.size))
