"""`experience label`: say that a bag was a success or a failure."""

import argparse

from episode_store.episode import Episode
from episode_store.label import label_from_text
from episode_store.lock import changing
from episode_store.relearn import relearnt_sentence
from experience_cli.bag_argument import find_whole_bag


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    episode = find_whole_bag(arguments.bag, arguments.bags)
    with changing(episode.task_path):
        Episode(episode).judge(label_from_text(arguments.label, arguments.bag))
        is_back = arguments.label == 'none'
        print(f'{episode.name}: ' + (
            'its label is taken back' if is_back else f'labelled {arguments.label}'))
        print(relearnt_sentence(episode.task))
    return 0
