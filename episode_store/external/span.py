"""A part of a drive that others recorded, from one second of it to another."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
import math

import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import RawMessages


@dataclass(frozen=True)
class Span:
    """
    What is read of a drive; seconds count from its first pose, as in what is said of it.

    Parameters
    ----------
    first, last : float, [s]
        Both within it.

    """

    first: float = 0.0
    last: float = math.inf

    @property
    def is_whole(self) -> bool:
        """Return whether it is all of the drive."""
        return self.first <= 0.0 and self.last == math.inf

    def __str__(self) -> str:
        """Say which part it is."""
        end = 'its end' if self.last == math.inf else f'{self.last:.2f} s'
        return (f'only the part from {self.first:.2f} s to {end} is read (seconds count from '
                f'there, those of --from and --to from the first pose of all)')

    def holds(
        self, times_ns: npt.NDArray[np.int64], begins_ns: int,
    ) -> npt.NDArray[np.bool_]:
        """Return which times [ns] lie within it, for a drive that begins at one of them."""
        seconds = (times_ns - begins_ns) * 1e-9
        return np.asarray((seconds >= self.first - 1e-6) & (seconds <= self.last + 1e-6))

    def log_times(
        self, stamps_ns: npt.NDArray[np.int64], log_times: npt.NDArray[np.int64], begins_ns: int,
    ) -> tuple[int, int, float, float]:
        """
        Return when its first and last pose were recorded, and between when there should be any.

        Parameters
        ----------
        stamps_ns, log_times : ndarray, shape (n,), [ns]
            Of the poses of the whole drive.
        begins_ns : int, [ns]
            The stamp that its seconds count from.

        Returns
        -------
        first, last, since, until : [ns]
            In times of the recording.

        Raises
        ------
        BagError
            If there is none in it.

        """
        inside = self.holds(stamps_ns, begins_ns)
        if not inside.any():
            seconds = (int(stamps_ns.max(initial=begins_ns)) - begins_ns) * 1e-9
            raise BagError(f'no pose is within --from {self.first:g} --to {self.last:g}, the '
                           f'drive has {seconds:.2f} s')
        logs, stamps = log_times[inside], stamps_ns[inside] - begins_ns
        first, last = int(logs.min()), int(logs.max())
        return (first, last, first - (int(stamps.min()) - self.first * 1e9),
                last + self.last * 1e9 - int(stamps.max()))


def cut(tables: Iterable[RawMessages], first: int, last: int) -> dict[str, RawMessages]:
    """Return what of some topics was recorded between two moments [ns], by topic."""
    found = {}
    for table in tables:
        inside = (table.log_times >= first) & (table.log_times <= last)
        found[table.topic] = replace(
            table, starts=table.starts[inside], sizes=table.sizes[inside],
            log_times=table.log_times[inside])
    return found
