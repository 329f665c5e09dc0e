"""What is missing of bags that a command only reads, said beside its output."""

from collections.abc import Iterable
import shlex
import sys

from episode_store.cut import has_its_end, missing_of_bag
from episode_store.gaps import gaps_in
from episode_store.lock import is_in_use
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder


def say_cuts(command: str, episodes: Iterable[EpisodeFolder]) -> None:
    """
    Say of each bag that was not closed what is missing, in a line on stderr; nothing is changed.

    Raises
    ------
    BagError
        If one cannot be read.

    """
    for episode in episodes:
        if not has_its_end(episode.path):
            say_cut(command, episode)


def say_cut(command: str, episode: EpisodeFolder) -> None:
    """Say what is missing of one bag, see `say_cuts`; here its index is looked at, too."""
    missing = missing_of_bag(episode.path)
    if not missing:
        return
    advice = f'`experience repair {shlex.quote(str(episode.path))}` mends it'
    if is_in_use(episode.task_path):
        advice = 'it is being recorded or changed just now'
    print(f'experience {command}: {episode.path} was not closed: {missing}; {advice}',
          file=sys.stderr)


def say_gaps(command: str, episode: EpisodeFolder) -> bool:
    """Say, in a line on stderr, what is missing in the middle of a bag; tell whether anything."""
    try:
        gaps = gaps_in(episode.path)
    except BagError:
        return False  # what cannot be read at all is said where it is learnt from
    if gaps:
        print(f'experience {command}: {episode.name}: {gaps}', file=sys.stderr)
    return bool(gaps)
