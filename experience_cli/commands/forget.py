"""`experience forget`: un-teach a bag."""

import argparse
from pathlib import Path
from typing import Any

from experience_cli.bag_argument import add_bag
from experience_cli.errors import UserError


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Add the command."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        'forget', help='take a bag out of the memory; --undo brings it back',
        description='Take a bag out of the memory: the field is then as if it never was. The bag '
        'is moved to .forgotten in the folder of its task and keeps its number.')
    add_bag(parser)
    parser.add_argument('--undo', action='store_true',
                        help='bring a bag back that was forgotten, dropped or thrown away; of a '
                        'TASK alone what was taken away last')
    return parser


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    from episode_store.relearning import relearnt_sentence
    from episode_store.task_folder import changing
    from experience_cli.bag_argument import task_of

    find = _task_and_bag if arguments.undo else task_of
    task, number, kind = find(arguments.bag, arguments.bags)
    with changing(task.path):
        if arguments.undo:
            _bring_back(task, number, kind)
        elif number is not None:
            _forget(arguments, task, number)
        print(relearnt_sentence(task))
    return 0


def _task_and_bag(text: str, bags: Path | None) -> tuple[Any, int | None, str]:
    """Return task, number and kind of a bag, or of a task alone."""
    from experience_cli.bag_argument import BAGS, task_folder, task_of

    for folder in (Path(text), (bags or BAGS) / text):
        task = task_folder(folder)
        if task is not None:
            return task, None, ''
    return task_of(text, bags)


def _bring_back(task: Any, number: int | None, kind: str) -> None:
    from episode_store.undo import bring_back, names_of

    if number is not None:
        _check_kind(task, number, kind)
    back = bring_back(task, number)
    print(f'{names_of(back)} {"is" if len(back) == 1 else "are"} back in {task.path}')


def _forget(arguments: argparse.Namespace, task: Any, number: int) -> None:
    from episode_store.undo import take_away
    from experience_cli.bag_argument import find_whole_bag, named

    find_whole_bag(arguments.bag, arguments.bags)
    episode = take_away(task, [number])[0]
    print(f'{episode.name} is forgotten (kept in {episode.path}; `experience forget --undo '
          f'{named(arguments.bag, arguments.bags)}` brings it back)')


def _check_kind(task: Any, number: int, kind: str) -> None:
    for episode in task.forgotten():
        if episode.number == number and kind not in ('', episode.kind):
            raise UserError(f'{episode.name} is a {episode.kind}, no {kind}')
