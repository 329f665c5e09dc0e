"""A bag as a drive: what was recorded when, in seconds from where the drive begins."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

from control_field.headings import N_HEADINGS
from control_field.records import ControlField, Prototypes
from episode_store.episode import find_topic, read_header
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.columns import read_columns
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import BagReader, RawMessages
from episode_store.task_folder import EpisodeFolder
from msgs_bridge.messages.cdr import POINT_CLOUD, struct_from_cdr
from msgs_bridge.messages.tables import field_from_cloud, prototypes_from_cloud

#: The compass of the eight headings, index 0 along +x.
COMPASS = ('E', 'NE', 'N', 'NW', 'W', 'SW', 'S', 'SE')
#: What people call them: the way of +x is east, that of +y north.
DIRECTIONS = dict(zip((*COMPASS, '-'), (
    'east', 'north-east', 'north', 'north-west', 'west', 'south-west', 'south', 'south-east',
    'nowhere'), strict=True))


def compass(heading: int) -> str:
    """Return the name of a heading, ``-`` for none."""
    return COMPASS[heading] if 0 <= heading < N_HEADINGS else '-'


@dataclass(frozen=True, eq=False)
class Poses:
    """
    The odometry of a drive, message by message.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
    log_times : ndarray of int64, shape (n,), [ns]
    xyyaw : ndarray, shape (n, 3), [m] and [rad]

    """

    stamps: npt.NDArray[np.float64]
    log_times: npt.NDArray[np.int64]
    xyyaw: npt.NDArray[np.float64]


class Recording:
    """
    A bag of ours, opened.

    Parameters
    ----------
    episode : EpisodeFolder
        The bag; it is read as far as it is readable.

    Raises
    ------
    BagError
        If it cannot be read, or is none of ours.

    """

    def __init__(self, episode: EpisodeFolder) -> None:
        self.episode = episode
        self.header: EpisodeHeader = read_header(episode.path)
        self.reader = BagReader(episode.bag)
        self.poses = self._read_poses()

    def messages(self, role: str) -> RawMessages:
        """Return the messages of a topic by its role, such as `odom`."""
        return self.reader.messages(find_topic(self.reader.topics, role, self.header.topics))

    @property
    def start(self) -> float:
        """Return the stamp at which the drive begins, [s]; 0 for a bag without odometry."""
        return float(self.poses.stamps[0]) if len(self.poses.stamps) else 0.0

    @property
    def duration(self) -> float:
        """Return how long the drive lasts, [s]."""
        stamps = self.poses.stamps
        return float(stamps[-1] - stamps[0]) if len(stamps) else 0.0

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of messages by topic."""
        return {topic: len(self.reader.messages(topic)) for topic in self.reader.topics}

    @property
    def begun(self) -> float | None:
        """Return the time of day of the first record, [s] since 1970; None in simulated time."""
        first = min((int(self.reader.messages(topic).log_times.min())
                     for topic, n in self.counts.items() if n), default=0) * 1e-9
        return first if first > 1e9 else None

    def field(self, before: int | None = None) -> ControlField | None:
        """
        Return the newest field, at most as new as a log time [ns]; None if there is none.

        Raises
        ------
        BagError
            If what was recorded is no field.

        """
        field: ControlField | None = self._table('control_field', field_from_cloud, before)
        return field

    def prototypes(self, before: int | None = None) -> Prototypes | None:
        """Return the newest prototypes, see `field`."""
        prototypes: Prototypes | None = self._table('prototypes', prototypes_from_cloud, before)
        return prototypes

    def _table(self, role: str, read: Any, before: int | None) -> Any:
        messages = self.messages(role)
        times = messages.log_times
        found = np.arange(len(times)) if before is None else np.flatnonzero(times <= before)
        if not len(found):
            return None
        try:
            return read(_cloud(messages[int(found[-1])]))
        except ValueError as error:
            raise BagError(f'{self.episode.path}: {error}') from None

    def _read_poses(self) -> Poses:
        messages = self.messages('odom')
        names = ('sec', 'nanosec', 'x', 'y', 'qx', 'qy', 'qz', 'qw')
        if not len(messages):
            return Poses(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
        columns = read_columns(messages, dict.fromkeys(names, 1))
        kept = columns.accepted
        sec, nanosec, x, y, qx, qy, qz, qw = (columns.values[name][kept] for name in names)
        yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        return Poses(sec + nanosec * 1e-9, messages.log_times[kept],
                     np.stack([x, y, yaw], axis=1))


def _cloud(message: bytes) -> SimpleNamespace:
    """Return a serialised PointCloud2 with the attributes of the message."""
    values = struct_from_cdr(POINT_CLOUD, message)
    values['header'] = SimpleNamespace(frame_id=values['frame_id'])
    values['fields'] = [SimpleNamespace(**each) for each in values['fields']]
    return SimpleNamespace(**values)
