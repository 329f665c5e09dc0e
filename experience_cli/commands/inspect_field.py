"""`experience inspect`: a picture of what was learnt."""

import argparse
from functools import partial
from pathlib import Path

from control_field.drives.breaks import place_text
from episode_store.episode import Episode
from episode_store.relearn import relearn
from episode_store.task_folder import EpisodeFolder
from experience_cli.bag_argument import episodes_from_paths, episodes_up_to, named_path
from experience_cli.bag_summary import say_cut, say_gaps
from experience_cli.errors import UserError
from experience_cli.external_bags import borrowed, is_borrowed
from experience_cli.figures.inspection_figure import inspection_figure
from experience_cli.output import write_output


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    arguments.bag = named_path(arguments.bag)
    if is_borrowed(arguments, arguments.bag):
        path = arguments.bag.resolve()
        with borrowed(arguments, arguments.bag) as episode:
            _inspect(arguments, episode, path.with_name(f'{path.name}.png'))
    else:
        last = episodes_from_paths([arguments.bag])[-1]
        _inspect(arguments, last, last.path.parent / f'{last.path.name}.png')
    return 0


def _inspect(arguments: argparse.Namespace, last: EpisodeFolder, beside: Path) -> None:
    """Draw what the bags up to one have taught, and say it."""
    episodes = episodes_up_to(last)
    relearner, each = relearn(episodes)
    for episode in map(Episode, episodes):
        say_cut('inspect', episode)
        say_gaps('inspect', episode)
    if relearner is None or relearner.refresh is None:
        raise UserError(f'{arguments.bag}: nothing was learnt up to there')
    learnt_bag = [learnt_bag for learnt_bag in each if learnt_bag.content is not None][-1]
    out = arguments.out or beside
    write_output(out, partial(inspection_figure(learnt_bag, relearner).savefig, format='png'))
    certificate = relearner.refresh.certificate
    print(f'{last.name}: {certificate.sentence()}')
    places = ', '.join(map(place_text, relearner.teach_here(3)))
    if places:
        print(f'One more drive to the goal would help most from (x, y) = {places} m.')
    print(f'in numbers: {certificate.numbers()}')
    print(out)
