"""
Whether the places of a drive fit the headings and speeds that came with them.

A robot on wheels drives where it looks, and as far as it says: that tells a leap of a few
decimetres from driving even where poses are seconds apart. What does not fit most of the drive (no
speeds, those of another frame, a robot that drives sideways) says nothing and is not asked.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import Break, BreakKind

Floats = npt.NDArray[np.float64]

#: Strides of so long, [s], show whether what is said is so, whatever single steps jitter.
_STRIDE, _FEWEST_STRIDES = 0.5, 6
#: Share of the way by which places may miss in the middle if speeds, or headings, are to count.
_TRUSTED: Final = 0.25
#: Driving is what is no shorter than this share of the longest steps, but for so many leaps, or
#: such a share of leaps, and than this, [m].
_SHORT, _LEAPS, _LEAPING, _NOISE = 0.25, 3, 0.05, 1e-3
#: A step may miss by so many times what nine in ten of this drive's steps miss by.
_MORE: Final = 3.0
#: Wheels may be measured too small by this share; a robot that slips drives less than it says.
_SCALE: Final = 0.25
#: A localisation may glide by so much, [m], within so many seconds.
_GLIDE, _GLIDING = 0.5, 2.0
#: A step this many times as long as usual, in time, hides how the robot drove meanwhile.
_LONG: Final = 1.5


@dataclass(frozen=True, eq=False)
class Motion:
    """
    What came with the places of a drive.

    Parameters
    ----------
    yaw : ndarray, shape (n,), [rad]
        Where the robot looked.
    velocity : ndarray, shape (n, 2), [m/s], or None
        Ahead and to the left; None where the messages carry none.

    """

    yaw: Floats
    velocity: Floats | None = None

    def at(self, index: npt.NDArray[np.int64] | npt.NDArray[np.bool_]) -> 'Motion':
        """Return what came with some of the places."""
        return Motion(self.yaw[index], None if self.velocity is None else self.velocity[index])


@dataclass(frozen=True, eq=False)
class DeadReckoning:
    """
    Where each step should have led.

    Parameters
    ----------
    way : ndarray, shape (n, 2), [m]
        From the first place on, as the speeds say; where only headings are to be trusted, as if
        it drove 1 m in each step.
    has_speeds : bool
        Whether the way is known, or only its direction.
    hidden : ndarray, shape (n - 1,), [m]
        What a step that lasted longer than others may hide.
    usual : float, [m]
        By how much nine in ten steps miss.

    """

    way: Floats
    has_speeds: bool
    hidden: Floats
    usual: float = 0.0

    def is_trusted(self, xy: Floats, stride: int) -> bool:
        """Return whether most strides of so many steps lead where they should, as far as said."""
        first = np.arange(len(xy) - stride)
        if len(first) < _FEWEST_STRIDES:
            return False
        done, said = (each[first + stride] - each[first] for each in (xy, self.way))
        far = np.hypot(*done.T)
        driven = _driven(far)
        if self.has_speeds:
            driven |= _driven(np.hypot(*said.T))
        if driven.sum() < _FEWEST_STRIDES:
            return False
        missed = self.misses(xy, first, first + stride)
        if self.has_speeds:
            missed = np.maximum(missed, _off_segment(said, (1.0 + _SCALE) * done))
        return bool(np.median(missed[driven]) <= _TRUSTED * np.median(far[driven]))

    def usual_miss(self, xy: Floats) -> float:
        """Return by how much nine in ten steps miss, [m]; the worst of a few may be a leap."""
        first = np.arange(len(xy) - 1)
        driven = _driven(np.hypot(*np.diff(xy, axis=0).T))
        missed = np.sort(self.misses(xy, first, first + 1)[driven])
        return float(missed[min(int(0.9 * len(missed)), len(missed) - 2)]) if (
            len(missed) > 1) else 0.0

    def misses(self, xy: Floats, first: npt.NDArray[np.int64], last: npt.NDArray[np.int64]
               ) -> Floats:
        """Return by how much the way between some places is none that was said, [m]."""
        done, said = xy[last] - xy[first], self.way[last] - self.way[first]
        if self.has_speeds:
            return _off_segment(done, (1.0 + _SCALE) * said)
        heads, steps = np.diff(self.way, axis=0), np.diff(xy, axis=0)
        across = heads[:, 0] * steps[:, 1] - heads[:, 1] * steps[:, 0]
        aside = np.concatenate([[0.0], np.cumsum(across)])
        return np.asarray(np.abs(aside[last] - aside[first]))

    def leaps(self, stamps: Floats, xy: Floats, pose_jump: float) -> list[Break]:
        """
        Return the steps that lead elsewhere, or else where places glide away.

        Parameters
        ----------
        stamps : ndarray, shape (n,), [s]
            Not decreasing.
        xy : ndarray, shape (n, 2), [m]
        pose_jump : float, [m]
            How far a pose may be off.

        """
        steps = np.arange(len(stamps) - 1)
        most = pose_jump + _MORE * self.usual + self.hidden
        found = np.flatnonzero((self.misses(xy, steps, steps + 1) > most)
                               & (np.diff(stamps) > 0.0))
        if len(found):
            return [self._break(i, i + 1, stamps, xy) for i in found.tolist()]
        return self._glides(stamps, xy)

    def fits(self, xy: Floats, i: int, j: int, pose_jump: float) -> bool:
        """Return whether a robot can have come from one place straight to another."""
        if not self.has_speeds:
            return True
        missed = self.misses(xy, np.array([i]), np.array([j]))[0]
        return bool(missed <= pose_jump + _MORE * self.usual + self.hidden[i:j].sum())

    def _glides(self, stamps: Floats, xy: Floats) -> list[Break]:
        """Return where small steps together lead elsewhere, within seconds; one is enough."""
        lag = 2
        while lag < len(stamps):
            first = np.flatnonzero(stamps[lag:] - stamps[:-lag] <= _GLIDING)
            missed = self.misses(xy, first, first + lag)
            most = np.convolve(self.hidden, np.ones(lag), 'valid')[first]
            far = missed > _GLIDE + _MORE * self.usual + most
            if far.any():
                at = int(first[far][0])
                return [self._break(at, at + lag, stamps, xy)]
            if not len(first):
                break
            lag *= 2
        return []

    def _break(self, before: int, after: int, stamps: Floats, xy: Floats) -> Break:
        (x, y), (next_x, next_y) = xy[before].tolist(), xy[after].tolist()
        said = float(np.hypot(*(self.way[after] - self.way[before])))
        return Break(BreakKind.UNSAID, after, float(stamps[after] - stamps.min()),
                     float(stamps[after] - stamps[before]), (x, y), (next_x, next_y),
                     said if self.has_speeds else np.inf)


def reckoned(stamps: Floats, xy: Floats, motion: Motion) -> DeadReckoning | None:
    """
    Return where each step should have led; None if nothing that came with it is to be trusted.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
        Not decreasing.
    xy : ndarray, shape (n, 2), [m]
    motion : Motion
        What came with these.

    """
    dt, turned = np.diff(stamps), np.angle(np.exp(1j * np.diff(motion.yaw)))
    middle = motion.yaw[:-1] + 0.5 * turned
    usual = float(np.median(dt[dt > 0.0])) if (dt > 0.0).any() else 0.0
    stride = max(round(_STRIDE / max(usual, 1e-3)), 1)
    nothing = np.zeros(len(dt))
    for said, has_speeds in _ways(dt, middle, motion):
        way = np.concatenate([np.zeros((1, 2)), np.cumsum(said, axis=0)])
        found = DeadReckoning(way, has_speeds, nothing)
        if found.is_trusted(xy, stride):
            hidden = _hidden(dt, said, turned, motion) if has_speeds else nothing
            # Within a step a robot goes no farther astray than it drives, whatever the others say.
            astray = float(np.percentile(np.hypot(*said.T), 95)) if has_speeds else np.inf
            return replace(found, usual=min(found.usual_miss(xy), astray / _MORE),
                           hidden=np.where(dt > _LONG * usual, hidden, 0.0))
    return None


def _ways(dt: Floats, middle: Floats, motion: Motion) -> list[tuple[Floats, bool]]:
    """
    Return how far each step goes as the speeds say, and that these are speeds; else the headings.

    Some senders give speeds in the robot's frame, as they should, some in that of the places.
    """
    heads = np.stack([np.cos(middle), np.sin(middle)], axis=1)
    if motion.velocity is None:
        return [(heads, False)]
    mean = 0.5 * (motion.velocity[1:] + motion.velocity[:-1]) * dt[:, np.newaxis]
    left = np.stack([-heads[:, 1], heads[:, 0]], axis=1)
    return [(mean[:, :1] * heads + mean[:, 1:] * left, True), (mean, True), (heads, False)]


def _hidden(dt: Floats, said: Floats, turned: Floats, motion: Motion) -> Floats:
    """Return how far off turning and other speeds within a step may lead, [m]."""
    if motion.velocity is None:
        return np.zeros(len(dt))
    change = np.hypot(*np.diff(motion.velocity, axis=0).T)
    return np.asarray(0.5 * change * dt + np.hypot(*said.T) * np.abs(np.sin(turned)))


def _driven(way: Floats) -> npt.NDArray[np.bool_]:
    """Return which steps are driving: not much shorter than the longest, but for a few leaps."""
    rank = len(way) - 1 - max(_LEAPS, round(_LEAPING * len(way)))
    longest = np.sort(way)[max(rank, 0)] if len(way) else 0.0
    return np.asarray(way > max(_SHORT * float(longest), _NOISE))


def _off_segment(done: Floats, said: Floats) -> Floats:
    """Return how far places are off the straight way from 0 to where it should lead."""
    length = (said * said).sum(axis=1)
    share = np.clip((done * said).sum(axis=1) / np.maximum(length, 1e-12), 0.0, 1.0)
    return np.asarray(np.hypot(*(done - share[:, np.newaxis] * said).T))
