"""`experience forget`: un-teach a bag."""

import argparse
from typing import Any

from experience_cli.errors import UserError
from experience_cli.references import add_bag


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Add the command."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        'forget', help='un-teach a bag',
        description='Take a bag out of the memory: the field is then as if it never was. The bag '
        'is moved to .forgotten in the folder of its task and keeps its number.')
    add_bag(parser)
    parser.add_argument('--undo', action='store_true', help='bring a forgotten bag back')
    return parser


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    from experience_cli.references import task_of
    from experience_cli.relearning import relearnt_sentence
    from msgs_bridge.bag_folder import changing

    task, number, kind = task_of(arguments.bag, arguments.bags)
    with changing(task.path):
        if arguments.undo:
            _check_kind(task, number, kind)
            episode = task.recall(number)
            print(f'{episode.name} is back in {episode.path}')
        else:
            _forget(arguments, task, number)
        print(relearnt_sentence(task))
    return 0


def _forget(arguments: argparse.Namespace, task: Any, number: int) -> None:
    from experience_cli.references import find_whole_bag, named

    find_whole_bag(arguments.bag, arguments.bags)
    episode = task.forget(number)
    print(f'{episode.name} is forgotten (kept in {episode.path}; `experience forget --undo '
          f'{named(arguments.bag, arguments.bags)}` brings it back)')


def _check_kind(task: Any, number: int, kind: str) -> None:
    for episode in task.forgotten():
        if episode.number == number and kind not in ('', episode.kind):
            raise UserError(f'{episode.name} is a {episode.kind}, no {kind}')
