"""What is wrong with a bag of ours: one answer, whoever asks."""

from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from control_field.words import counted
from episode_store.errors import NothingToLearnError
from episode_store.gaps import BagGaps
from episode_store.lock import is_in_use
from episode_store.rosbag2.bag_files import read_description
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.metadata import NAME
from episode_store.rosbag2.reader import BagReader

if TYPE_CHECKING:
    from episode_store.episode import Episode


@dataclass(frozen=True)
class Damage:
    """
    Everything that is wrong with a bag; false if nothing is.

    Parameters
    ----------
    unreadable : str
        Why it cannot be read, or is none of ours; then nothing else is known of it.
    cut : str
        What of it is missing since it was not closed, as mending would say.
    is_busy : bool
        Whether it was not closed yet: a learner records it, or a command changes it.
    gaps : BagGaps
        What is missing in its middle.
    is_forgotten : bool
        Whether it was taken out of the memory.

    """

    unreadable: str = ''
    cut: str = ''
    is_busy: bool = False
    gaps: BagGaps = field(default_factory=BagGaps)
    is_forgotten: bool = False

    def __bool__(self) -> bool:
        """Return True if anything is wrong."""
        return bool(self.state)

    @property
    def state(self) -> str:
        """Return the worst of it in a word, as `experience list` has it; empty for none."""
        return next((name for name, holds in (
            ('unreadable', self.unreadable), ('forgotten', self.is_forgotten),
            ('recording', self.is_busy), ('cut', self.cut), ('incomplete', self.gaps)) if holds),
            '')


def find_damage(episode: 'Episode') -> Damage:
    """Look for everything that is wrong with a bag; see `Episode.damage`."""
    folder, gaps, cut = episode.folder, BagGaps(), ''
    try:
        cut = '' if episode.is_closed else _what_is_cut(episode)
        gaps = episode.gaps
    except NothingToLearnError:
        pass  # there is no message that another one is missing beside
    except (BagError, OSError) as error:
        why = error_line('read', folder.path, error) if isinstance(error, OSError) else str(error)
        return Damage(why, is_forgotten=folder.is_forgotten)
    return Damage('', cut, bool(cut) and is_in_use(folder.task_path), gaps, folder.is_forgotten)


def _what_is_cut(episode: 'Episode') -> str:
    """Say what of a bag that was not closed is missing."""
    path = episode.folder.bag
    if not path.exists() or path.stat().st_size == 0:
        return 'it is empty: its recorder was stopped at once'
    reader = BagReader(path, verify=True)
    if not reader.damage:
        return f'{NAME} is missing; no message is missing'
    times = [reader.messages_of([number]).log_times for number in reader.channels]
    n_messages, n_recorded = sum(map(len, times)), _n_recorded(episode)
    lost = (f'{counted(reader.n_lost_bytes, "byte")} cannot be read' if reader.n_lost_bytes
            else 'what came after is missing')
    if not n_messages:
        return f'{reader.damage}; no message can be read; {lost}'
    of_all = f'{n_messages} of ' if n_recorded > n_messages else ''
    found = (f'{reader.damage}; {of_all}{counted(max(n_messages, n_recorded), "message")} '
             f'can be read')
    if reader.complete:
        return f'{found}, no message is missing'
    last = max(int(each.max()) for each in times if len(each)) / 1e9
    return f'{found}, the last at {last:.3f} s; {lost}'


def _n_recorded(episode: 'Episode') -> int:
    """Return how many messages a bag held when it was closed; 0 if it never was."""
    with suppress(BagError):
        description = read_description(episode.folder.path)
        return description.count or 0 if description else 0
    return 0
