"""`experience repair`: mend bags whose recorder was killed."""

import argparse

from episode_store.lock import changing
from episode_store.repair import repair_bag
from experience_cli.bag_argument import episodes_of_all, named_path


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    for episode in episodes_of_all([named_path(path) for path in arguments.bags]):
        with changing(episode.task_path):
            print(repair_bag(episode.path))
    return 0
