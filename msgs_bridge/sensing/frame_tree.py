"""A tree of frames: which is where in which other one, and when."""

from collections.abc import Iterator
from dataclasses import dataclass, field
import struct
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from msgs_bridge.sensing.corrections import Correction, SLIGHT, spread
from msgs_bridge.sensing.rigid_motions import Motions, STILL

TF_TYPE: Final = 'tf2_msgs/msg/TFMessage'
#: How the robot's middle is called, the likeliest first.
BASES: Final = ('base_footprint', 'base_link')
#: A joint that moves less than this is none, [m] and as a difference of quaternions.
_FIXED: Final = 2e-3
#: Frames between two others, at most: a chain that is longer bites its tail.
_LONGEST: Final = 50

Floats = npt.NDArray[np.float64]


class Lost(NamedTuple):
    """
    Messages before the first, or behind the last, that says where a frame was.

    Parameters
    ----------
    why : str
        They say nothing of it.
    next_to : int, [ns]
        When the first, or the last, that does was recorded.
    log_times : ndarray of int64, shape (n,), [ns]
        When they were.

    """

    why: str
    next_to: int
    log_times: npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Edge:
    """
    Where a frame is in the one above it.

    Parameters
    ----------
    parent, child : str
    stamps_ns, log_times : ndarray of int64, shape (n,), [ns]
        Increasing stamps, and when each was received.
    motions : Motions
    lost : tuple of Lost
        Messages about the child before the first of these, and after the last.
    begins_ns : int, [ns]
        First stamp of the child, wherever it is.

    """

    parent: str
    child: str
    stamps_ns: npt.NDArray[np.int64]
    log_times: npt.NDArray[np.int64]
    motions: Motions
    lost: tuple[Lost, ...] = ()
    begins_ns: int = 0

    @property
    def is_fixed(self) -> bool:
        """Return whether it stays as it is."""
        shift, turn = self.motions
        same = np.abs((turn * turn[:1]).sum(axis=1))
        return bool(np.abs(shift - shift[:1]).max() < _FIXED and (1.0 - same).max() < _FIXED**2)

    def at(self, stamps_ns: npt.NDArray[np.int64]) -> Motions:
        """Return it at some times."""
        start = self.stamps_ns[0]
        return self.motions.between((self.stamps_ns - start) * 1e-9, (stamps_ns - start) * 1e-9)

    def carrying(
        self, stamps_ns: npt.NDArray[np.int64], motions: Motions,
    ) -> tuple[Motions, list[Correction]]:
        """
        Return motions in the child's frame at some times in the parent's.

        Where the frame leaps, they leap; where it was corrected by a little, that is spread over
        the way before, and what was corrected returned.
        """
        if len(self.stamps_ns) < 2:
            return self.at(stamps_ns).then(motions), []
        start = self.stamps_ns[0]
        seconds, own = (stamps_ns - start) * 1e-9, (self.stamps_ns - start) * 1e-9
        inside = motions.between(seconds, own)
        steps = (self.motions.at(slice(1, None)).then(inside.at(slice(1, None))).shift
                 - self.motions.at(slice(0, -1)).then(inside.at(slice(1, None))).shift)
        large = (np.linalg.norm(steps, axis=1) > SLIGHT) & (own[1:] > seconds[0]) & (
            own[:-1] < seconds[-1])
        after = np.clip(np.searchsorted(own, seconds, side='right'), 1, len(own) - 1)
        held = self.motions.at(after - 1).then(motions)
        is_held = large[after - 1] & (seconds < own[after])
        found = Motions(*(np.where(is_held[:, np.newaxis], old, new) for old, new in zip(
            held, self.at(stamps_ns).then(motions), strict=True)))
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(
            np.diff(motions.shift, axis=0), axis=1))])
        added, corrections = spread(seconds, way, [
            Correction(float(own[i + 1]), tuple(steps[i].tolist()))
            for i in np.flatnonzero(large).tolist()])
        return found._replace(shift=found.shift + added), corrections


@dataclass
class Transforms:
    """
    A bag's tree of frames.

    Parameters
    ----------
    edges : dict of str to Edge
        By the child's frame.
    n_refused : int
        Transforms that are none: not finite, or no rotation.

    """

    edges: dict[str, Edge] = field(default_factory=dict)
    n_refused: int = 0

    def above(self, frame: str) -> list[str]:
        """Return a frame and those above it, the nearest first."""
        found = [frame]
        while (found[-1] in self.edges and len(found) < _LONGEST
               and self.edges[found[-1]].parent not in found):
            found.append(self.edges[found[-1]].parent)
        return found

    def chain(self, frame: str, top: str) -> list[Edge] | None:
        """Return the edges from a frame up to one above it, from the top; None if it is not."""
        above = self.above(frame)
        if top not in above:
            return None
        return [self.edges[each] for each in reversed(above[:above.index(top)])]

    def fixed(self, frame: str, seen_from: str) -> Motions | None:
        """Return where a frame is in another one; None if nothing says, or that changes."""
        ups, downs = self.above(frame), self.above(seen_from)
        common = next((each for each in ups if each in downs), None)
        if common is None:
            return None
        edges = [*(self.chain(frame, common) or ()), *(self.chain(seen_from, common) or ())]
        if not all(edge.is_fixed for edge in edges):
            return None
        return _composed(self.chain(seen_from, common) or []).inverse().then(
            _composed(self.chain(frame, common) or []))

    def bases(self) -> list[str]:
        """Return the frames that are called like a robot's middle, the likeliest first."""
        frames = {*self.edges, *(edge.parent for edge in self.edges.values())}
        return [frame for base in BASES for frame in sorted(frames)
                if frame.rpartition('/')[2] == base]


def _composed(edges: list[Edge]) -> Motions:
    found = STILL
    for edge in edges:
        found = found.then(edge.motions.at(slice(0, 1)))
    return found


def transforms_in(message: bytes) -> Iterator[tuple[int, str, str, tuple[float, ...]]]:
    """Go through a message: stamp [ns], parent, child, x y z qx qy qz qw."""
    if message[:2] not in (b'\x00\x01', b'\x00\x00'):
        raise struct.error
    order = '<' if message[1] else '>'
    n, = struct.unpack_from(f'{order}I', message, 4)
    at = 8
    for _ in range(n):
        at += (4 - at) % 4
        sec, nanosec = struct.unpack_from(f'{order}iI', message, at)
        parent, at = _text(message, at + 8, order)
        child, at = _text(message, at, order)
        at += (4 - at) % 8
        values = struct.unpack_from(f'{order}7d', message, at)
        at += 56
        yield sec * 1_000_000_000 + nanosec, parent.lstrip('/'), child.lstrip('/'), values


def _text(message: bytes, at: int, order: str) -> tuple[str, int]:
    at += (4 - at) % 4
    n, = struct.unpack_from(f'{order}I', message, at)
    if not n or at + 4 + n > len(message):
        raise struct.error
    return message[at + 4:at + 3 + n].decode(), at + 4 + n
