"""`experience list`: which bags there are, and how they ended."""

import argparse
from collections.abc import Iterator
import json
from pathlib import Path
import sys

from episode_store.episode import Episode
from episode_store.rosbag2.errors import BagError
from episode_store.summary import Summary, summary_of
from episode_store.task_folder import (
    episode_from_path, EpisodeFolder, is_named_like_own, task_folders)
from experience_cli.arguments import BAGS
from experience_cli.bag_argument import named_path, task_folder, tasks_in
from experience_cli.bag_summary import size_text, time_text
from experience_cli.errors import UserError
from experience_cli.terminal import table_lines

_TITLES = ('bag', 'kind', 'state', 'began', 'seconds', 'messages', 'steps', 'outcome', 'label',
           'size')
_RIGHT = (4, 5, 6, 9)


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    problems: list[str] = []
    folders = episodes_in(named_path(arguments.folder), problems)
    summaries = [summary_of(Episode(folder)) for folder in folders]
    if arguments.json:
        print(json.dumps([summary.to_json() for summary in summaries], indent=2))
    else:
        print('\n'.join(table_lines([_TITLES, *map(_row, summaries)], _RIGHT)))
    for summary in summaries if not arguments.json else ():
        if summary.state in ('cut', 'unreadable', 'not kept', 'aborted', 'incomplete'):
            print(f'{summary.bag}: {summary.note}')
    for problem in problems:
        print(f'not in the list: {problem}', file=sys.stderr)
    return 0


def episodes_in(folder: Path, problems: list[str]) -> Iterator[EpisodeFolder]:
    """
    Yield the bags of a task, or of all tasks in a folder, including forgotten ones.

    Parameters
    ----------
    folder : Path
    problems : list of str
        What cannot be read of one of several tasks is added here; the others are listed.

    Raises
    ------
    UserError
        If there are none.
    BagError
        If the folder, or that of the one task, cannot be read.

    """
    if not folder.is_dir():
        beside = BAGS if len(folder.parts) == 1 else folder.parent
        raise UserError(f'there is no folder {folder}{tasks_in(beside)}')
    task = task_folder(folder)
    if task is None and is_named_like_own(folder):
        yield episode_from_path(folder)
        return
    if task:
        yield from sorted([*task.episodes(), *task.forgotten()])
        return
    found = []
    for each in task_folders(folder):
        of_task = []
        for read in (each.episodes, each.forgotten):
            try:
                of_task += read()
            except BagError as error:
                problems.append(str(error))
        found += sorted(of_task)
    if not found and not problems:
        raise UserError(f'{folder} holds no bags, must be the folder of a task or of all tasks')
    yield from found


def _row(summary: Summary) -> tuple[str, ...]:
    n = summary.steps if summary.cells is None else summary.cells - 1
    return (
        summary.bag, summary.kind, summary.state, time_text(summary.begun),
        '-' if summary.duration is None else f'{summary.duration:.1f}', str(summary.messages),
        '-' if n is None else str(n), summary.outcome or '-', summary.label or '-',
        size_text(summary.size))
