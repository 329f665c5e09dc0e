"""What is missing in a recorded bag: found in its stamps, decision numbers and counts."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
import re
from typing import Any, Final, TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from control_field.words import counted
from episode_store.first_move import first_move
from episode_store.header import LOST_NAME
from episode_store.rosbag2.columns import read_columns
from episode_store.rosbag2.metadata import NAME, with_note, write_atomically
from episode_store.rosbag2.reader import RawMessages
from episode_store.rosbag2.topic_tables import statuses
from episode_store.task_folder import EpisodeKind
from msgs_bridge.messages.cdr import DESCRIBED
from msgs_bridge.untrusted.files import read_text

if TYPE_CHECKING:
    from episode_store.episode import Episode

#: Keys in rosbag2's ``custom_data``: of what is missing, and of what is missing before the drive.
KEY: Final = 'experience_incomplete'
KEY_BEFORE: Final = 'experience_before_the_drive'
#: Topics that come at a steady pace, by role: how many times the usual time without a message is
#: a hole, and how long it lasts at least, [s]. A local grid may come from a costmap, now and then.
_STEADY: Final = {'odom': (5.0, 0.5), 'neighbourhood': (10.0, 2.0)}
#: Types that come at a steady pace; a localisation speaks up when the robot has moved.
_STEADY_TYPES: Final = ('nav_msgs/msg/Odometry', 'nav_msgs/msg/OccupancyGrid')
#: A clock that goes back by more was set back; by less, a message came late, [s].
_SET_BACK: Final = 0.5
#: Seconds that are told from a start are not exact, [s].
_TINY: Final = 1e-6
#: A usual time is known from so many messages on.
_FEWEST: Final = 4
#: So many missing steps are named.
_NAMED: Final = 5
_TOPIC: Final = re.compile(r'[\w/~]+', re.ASCII)
#: Topics, by role, of which each message counts: what the middleware says it lost of them is.
_COUNTED: Final = ('experience', 'trial')


@dataclass(frozen=True)
class Hole:
    """
    A time in which nothing was recorded on a topic.

    Parameters
    ----------
    role : str
        Of the topic, such as ``odom``.
    start, end : float, [s]
        From the first odometry of the bag.

    """

    role: str
    start: float
    end: float

    def __str__(self) -> str:
        """Say it."""
        return (f'nothing on {self.role} from {self.start:.2f} s to {self.end:.2f} s '
                f'({self.end - self.start:.1f} s)')


@dataclass(frozen=True)
class BagGaps:
    """
    What is missing in a bag; false if nothing is.

    Parameters
    ----------
    holes : tuple of Hole
    n_missing : int
        Steps that were decided and whose decisions are not there.
    missing : tuple of int
        The numbers of the first of them.
    n_rows, n_decided : int
        Decisions that are there, and that were made.
    lost : mapping of str to int
        Messages that the middleware has lost, by topic.
    before : tuple of Hole
        Those that had ended before the robot moved first: nothing is missing in the drive.

    """

    holes: tuple[Hole, ...] = ()
    n_missing: int = 0
    missing: tuple[int, ...] = ()
    n_rows: int = 0
    n_decided: int = 0
    lost: Mapping[str, int] | None = None
    before: tuple[Hole, ...] = ()

    def __bool__(self) -> bool:
        """Return whether anything is missing."""
        lost = any(topic.rpartition('/')[2] in _COUNTED for topic in self.lost or {})
        return bool(self.holes or self.n_missing or self.n_decided > self.n_rows or lost)

    def __str__(self) -> str:
        """Say in a line what is missing; empty if nothing is."""
        if not self:
            return ''
        said = [str(hole) for hole in self.holes]
        if self.n_decided > self.n_rows:
            said.append(f'{self.n_decided - self.n_rows} of {self.n_decided} decisions are '
                        f'missing')
        if self.n_missing:
            numbers = ', '.join(map(str, self.missing))
            more = ' ...' if self.n_missing > len(self.missing) else ''
            said.append(f'{counted(self.n_missing, "step")} missing (number {numbers}{more})')
        said += [f'{counted(n, "message")} lost on {topic}'
                 for topic, n in sorted((self.lost or {}).items())]
        return f'the recording is incomplete: {"; ".join(said)}'

    def before_the_drive(self) -> str:
        """Say in a line what was not recorded before the robot moved; empty if nothing."""
        holes = '; '.join(map(str, self.before))
        return f'{holes}; the robot had not moved yet, nothing of its drive is missing' if (
            holes) else ''

    def hole_at(self, second: float, role: str = 'odom') -> Hole | None:
        """Return the hole of a topic that a second from the first odometry lies in, if any."""
        return next((hole for hole in (*self.holes, *self.before) if hole.role == role
                     and hole.start + _TINY < second < hole.end - _TINY), None)

    def to_json(self) -> list[dict[str, Any]]:
        """Return the holes by name."""
        return [{'topic': hole.role, 'from': round(hole.start, 3), 'to': round(hole.end, 3)}
                for hole in self.holes]


def note_gaps(episode: 'Episode') -> BagGaps:
    """
    Find what is missing in a bag, and keep it in its ``metadata.yaml`` for whoever reads that.

    Raises
    ------
    BagError
        If it cannot be read or written.

    """
    gaps, path = episode.gaps, episode.path / NAME
    try:
        before = read_text(path, within=episode.path)
    except (OSError, UnicodeDecodeError):
        return gaps  # not closed: said elsewhere
    text = with_note(before, KEY, str(gaps) or None, path)
    text = with_note(text, KEY_BEFORE, gaps.before_the_drive() or None, path)
    if text != before:
        write_atomically(path, text.encode())
    return gaps


def find_gaps(episode: 'Episode') -> BagGaps:
    """Find what is missing in the middle of a bag of ours; see `Episode.gaps`."""
    stamps = {role: _stamps(episode.messages(role)) for role in _STEADY}
    start = float(stamps['odom'][0]) if len(stamps['odom']) else 0.0
    is_demo, rows = episode.header.kind is EpisodeKind.DEMO, episode.decisions
    holes = [*_holes('odom', stamps['odom'], start, _bounds(episode)),
             *_holes('neighbourhood', stamps['neighbourhood'], start,
                     stamps['odom'][[0, -1]].tolist() if len(stamps['odom']) else [])]
    steps = np.unique(rows['step'].astype(np.int64))
    n_missing = int(steps[-1]) + 1 - len(steps) if len(steps) else 0
    # Of the first numbers, as many as there are steps and a few more, a few must be missing.
    missing = np.setdiff1d(np.arange(len(steps) + min(n_missing, _NAMED)), steps)[:_NAMED]
    begins = -math.inf
    if holes and is_demo:
        begins = first_move(episode.messages('odom'), episode.messages('cmd_vel'))
    before = tuple(hole for hole in holes if start + hole.end <= begins + _TINY)
    return BagGaps(
        tuple(hole for hole in holes if hole not in before), n_missing, tuple(missing.tolist()),
        len(rows), 0 if is_demo or episode.status is None else episode.status.decisions,
        _lost(episode), before)


def _bounds(episode: 'Episode') -> list[float]:
    """
    Return stamps of odometry that there was, [s]: what was decided and said answers one.

    A person who cuts a drive leaves that as it is: then there are none.
    """
    if episode.folder.whole.exists():
        return []
    if episode.header.kind is EpisodeKind.DEMO:
        return [status.stamp for _, status in statuses(episode.messages('trial'))
                if status.trial == 0]
    ended = [] if episode.status is None else [episode.status.stamp]
    return [*episode.decisions['stamp'].tolist(), *ended]


def _lost(episode: 'Episode') -> dict[str, int]:
    """Return how many messages the middleware has lost, by topic."""
    return {topic: int(n) for name, values in episode.bag.metadata if name == LOST_NAME
            for topic, n in values.items() if n.isdecimal() and _TOPIC.fullmatch(topic)}


def _stamps(messages: RawMessages) -> npt.NDArray[np.float64]:
    """Return the stamps of messages that come at a steady pace, as recorded, [s]."""
    fields = dict(DESCRIBED.get(messages.type_name, ()))
    if not len(messages) or messages.type_name not in _STEADY_TYPES or 'sec' not in fields:
        return np.zeros(0)
    columns = read_columns(messages, {'sec': 1, 'nanosec': 1})
    kept = columns.accepted
    return np.asarray(columns.values['sec'][kept] + columns.values['nanosec'][kept] * 1e-9,
                      dtype=np.float64)


def _holes(
    role: str, stamps: npt.NDArray[np.float64], start: float, bounds: list[float],
) -> list[Hole]:
    """Return where stamps are much farther apart than they usually are."""
    if len(stamps) < _FEWEST:
        return []
    steps = np.diff(stamps)
    # Several runs of one clock, if it was set back; in each of them, late ones change nothing.
    since = np.flatnonzero(np.concatenate([[True], steps < -_SET_BACK]))
    runs = [np.maximum.accumulate(run) for run in np.split(stamps, since[1:])]
    gains = np.concatenate([np.diff(run) for run in runs])
    if not (gains > 0.0).any():
        return []
    times, least = _STEADY[role]
    longest = max(times * float(np.median(gains[gains > 0.0])), least)
    if len(runs) == 1 and bounds:
        runs = [np.concatenate([[min(*bounds, stamps[0])], runs[0],
                                [max(*bounds, runs[0][-1])]])]
    return [Hole(role, float(run[i]) - start, float(run[i + 1]) - start)
            for run in runs for i in np.flatnonzero(np.diff(run) > longest).tolist()]
