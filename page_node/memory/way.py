"""The way that a bag holds, as the page shows it: in the order of time, not too fine."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from episode_store.episode import Episode
from episode_store.rosbag2.columns import read_columns
from msgs_bridge.messages.poses import MAX_PLACE

#: Poses a second, and in all, that are shown.
RATE: Final = 20.0
_MOST: Final = 30_000
#: Of times that are meant to be on a beat, [s].
_TINY: Final = 1e-6


@dataclass(frozen=True, eq=False)
class Way:
    """
    Where the robot was.

    Parameters
    ----------
    seconds : ndarray, shape (n,), [s]
        From the first odometry; never falling.
    xy : ndarray, shape (n, 2), [m]
    yaw : ndarray, shape (n,), [rad]
    log_times : ndarray of int64, shape (n,), [ns]
        When each was received.

    """

    seconds: npt.NDArray[np.float64]
    xy: npt.NDArray[np.float64]
    yaw: npt.NDArray[np.float64]
    log_times: npt.NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.seconds)

    def second_of(self, log_times: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Return when something was recorded, [s], within the drive; there must be one."""
        order = np.argsort(self.log_times, kind='stable')
        return np.interp(log_times.astype(np.float64), self.log_times[order].astype(np.float64),
                         np.maximum.accumulate(self.seconds[order]))


def way_of(episode: Episode) -> Way:
    """Return the way of a bag, `RATE` poses a second at most; none where there is no odometry."""
    poses = episode.poses
    usable = np.isfinite(poses.xyyaw).all(axis=1) & (
        np.abs(poses.xyyaw[:, :2]) <= MAX_PLACE).all(axis=1)
    seconds = (poses.stamps - episode.start)[usable]
    order = np.flatnonzero(usable)[np.argsort(seconds, kind='stable')]
    seconds = np.sort(seconds, kind='stable')
    kept = _thinned(seconds)
    rows = order[kept]
    return Way(seconds[kept], poses.xyyaw[rows, :2], poses.xyyaw[rows, 2], poses.log_times[rows])


def _thinned(seconds: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Return which of some times are kept: the first of each beat, and the last."""
    if not len(seconds):
        return np.zeros(0, dtype=np.int64)
    rate = min(RATE, _MOST / max(seconds[-1] - seconds[0], _TINY))
    first = np.unique(np.floor(seconds * rate + _TINY), return_index=True)[1]
    return np.union1d(first, [len(seconds) - 1]).astype(np.int64)


def commands_at(episode: Episode, way: Way) -> npt.NDArray[np.float32]:
    """
    Return the command to the wheels at each pose.

    Returns
    -------
    ndarray of float32, shape (2, n), [m/s] and [rad/s]
        NaN where none came before.

    """
    found = np.full((2, len(way)), np.nan, dtype=np.float32)
    messages = episode.messages('cmd_vel')
    if not len(messages):
        return found
    columns = read_columns(messages, {'vx': 1, 'wz': 1})
    kept = columns.accepted
    # Not by their stamps: those may be of another clock.
    times = way.second_of(messages.log_times[kept])
    order = np.argsort(times, kind='stable')
    newest = np.searchsorted(times[order], way.seconds + _TINY, side='right') - 1
    there = newest >= 0
    for row, name in enumerate(('vx', 'wz')):
        found[row, there] = columns.values[name][kept][order][newest[there]]
    return found
