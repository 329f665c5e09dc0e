"""`experience label`: say that a bag was a success or a failure."""

import argparse
from typing import Any

from experience_cli.bag_argument import add_bag


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Add the command."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        'label', help='say that a bag was a success or a failure',
        description='Judge a bag. A trial labelled a failure counts as given up, one labelled a '
        'success as having reached the goal, whatever it seemed to the robot; from a '
        'demonstration labelled a failure nothing is learnt. Nothing recorded is changed.')
    add_bag(parser)
    parser.add_argument('label', choices=('success', 'failure', 'none'),
                        help='none takes back what was said')
    return parser


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    from episode_store.judgement import judge_bag
    from episode_store.label import label_from_text
    from episode_store.relearning import relearnt_sentence
    from episode_store.task_folder import changing, TaskFolder
    from experience_cli.bag_argument import find_whole_bag

    episode = find_whole_bag(arguments.bag, arguments.bags)
    task = TaskFolder(episode.path.parent.parent, episode.path.parent.name)
    with changing(task.path):
        judge_bag(episode.path, label_from_text(arguments.label, arguments.bag))
        is_back = arguments.label == 'none'
        print(f'{episode.name}: ' + (
            'its label is taken back' if is_back else f'labelled {arguments.label}'))
        print(relearnt_sentence(task))
    return 0
