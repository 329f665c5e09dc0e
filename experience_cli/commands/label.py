"""`experience label`: say that a bag was a success or a failure."""

import argparse

from episode_store.judgement import judge_bag
from episode_store.label import label_from_text
from episode_store.relearning import relearnt_sentence
from episode_store.task_folder import changing, TaskFolder
from experience_cli.bag_argument import find_whole_bag


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    episode = find_whole_bag(arguments.bag, arguments.bags)
    task = TaskFolder(episode.path.parent.parent, episode.path.parent.name)
    with changing(task.path):
        judge_bag(episode.path, label_from_text(arguments.label, arguments.bag))
        is_back = arguments.label == 'none'
        print(f'{episode.name}: ' + (
            'its label is taken back' if is_back else f'labelled {arguments.label}'))
        print(relearnt_sentence(task))
    return 0
