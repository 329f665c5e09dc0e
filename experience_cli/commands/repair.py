"""`experience repair`: mend bags whose recorder was killed."""

import argparse
from pathlib import Path
from typing import Any


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Add the command."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        'repair', help='mend recordings that broke off',
        description='Mend bags whose recording broke off (a crash, no power, a full disk), and '
        'say what of them is lost. A whole bag is left as it is.')
    parser.add_argument('bags', nargs='+', type=Path, metavar='BAG_OR_TASK',
                        help='task1/0003, task1, or the folder of a bag or a task')
    return parser


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    from episode_store.repair import repair_bag
    from episode_store.task_folder import changing
    from experience_cli.bag_argument import named_path
    from experience_cli.bag_selection import episodes_of_all

    for episode in episodes_of_all([named_path(path) for path in arguments.bags]):
        with changing(episode.task_path):
            print(repair_bag(episode.path))
    return 0
