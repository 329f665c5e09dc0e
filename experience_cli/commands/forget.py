"""`experience forget`: un-teach a bag."""

import argparse
from pathlib import Path

from episode_store.lock import changing
from episode_store.relearn import relearnt_sentence
from episode_store.task_folder import TaskFolder
from episode_store.undo import bring_back, names_of, take_away
from experience_cli.arguments import BAGS
from experience_cli.bag_argument import find_whole_bag, named, task_folder, task_of
from experience_cli.errors import UserError


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    find = _task_and_bag if arguments.undo else task_of
    task, number, kind = find(arguments.bag, arguments.bags)
    with changing(task.path):
        if arguments.undo:
            _bring_back(task, number, kind)
        elif number is not None:
            _forget(arguments, task, number)
        print(relearnt_sentence(task))
    return 0


def _task_and_bag(text: str, bags: Path | None) -> tuple[TaskFolder, int | None, str]:
    """Return task, number and kind of a bag, or of a task alone."""
    for folder in (Path(text), (bags or BAGS) / text):
        task = task_folder(folder)
        if task is not None:
            return task, None, ''
    return task_of(text, bags)


def _bring_back(task: TaskFolder, number: int | None, kind: str) -> None:
    if number is not None:
        _check_kind(task, number, kind)
    back = bring_back(task, number)
    print(f'{names_of(back)} {"is" if len(back) == 1 else "are"} back in {task.path}')


def _forget(arguments: argparse.Namespace, task: TaskFolder, number: int) -> None:
    find_whole_bag(arguments.bag, arguments.bags)
    episode = take_away(task, [number])[0]
    print(f'{episode.name} is forgotten (kept in {episode.path}; `experience forget --undo '
          f'{named(arguments.bag, arguments.bags)}` brings it back)')


def _check_kind(task: TaskFolder, number: int, kind: str) -> None:
    for episode in task.forgotten():
        if episode.number == number and kind not in ('', episode.kind):
            raise UserError(f'{episode.name} is a {episode.kind}, no {kind}')
