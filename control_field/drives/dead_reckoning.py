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
from control_field.drives.speeds import period

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
#: Headings that differ by less, [rad], were not measured.
_TURNS: Final = 1e-3
#: A base is no farther ahead of its wheels or behind them, [m].
_AHEAD: Final = 0.5
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
    has_headings : bool
        Whether the robot drives where its headings say.
    swing : ndarray, shape (n, 2), [m], or 0
        Where the places lie beside the middle of the wheels, which alone goes where it looks.

    """

    way: Floats
    has_speeds: bool
    hidden: Floats
    usual: float = 0.0
    has_headings: bool = True
    swing: Floats | float = 0.0

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
        xy, said = xy - self.swing, self.way[last] - self.way[first]
        done = xy[last] - xy[first]
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
        most = self.unseen(pose_jump) + self.hidden
        found = np.flatnonzero((self.misses(xy, steps, steps + 1) > most)
                               & (np.diff(stamps) > 0.0))
        if len(found):
            return [self._break(i, i + 1, stamps, xy) for i in found.tolist()]
        glide = self.glide(stamps, xy, _GLIDE)
        return [] if glide is None else [glide]

    def fits(self, xy: Floats, i: int, j: int, pose_jump: float) -> bool:
        """Return whether a robot can have come from one place straight to another."""
        if not self.has_speeds:
            return True
        missed = self.misses(xy, np.array([i]), np.array([j]))[0]
        return bool(missed <= self.unseen(pose_jump) + self.hidden[i:j].sum())

    def unseen(self, pose_jump: float) -> float:
        """Return how far a step may miss and be none that leads elsewhere, [m]."""
        return pose_jump + _MORE * self.usual

    def glide(self, stamps: Floats, xy: Floats, allowed: float) -> Break | None:
        """
        Return where small steps together lead elsewhere within seconds; the first place is enough.

        Parameters
        ----------
        stamps : ndarray, shape (n,), [s]
            Not decreasing.
        xy : ndarray, shape (n, 2), [m]
        allowed : float, [m]
            So far they may, beyond what is usual.

        """
        longest = round(_GLIDING / max(period(stamps), 1e-3))
        for lag in (*(2 ** k for k in range(1, max(longest, 1).bit_length())), longest):
            first = np.flatnonzero(stamps[lag:] - stamps[:-lag] <= _GLIDING + 1e-6)
            if lag < 2 or not len(first):
                continue
            missed = self.misses(xy, first, first + lag)
            most = np.convolve(self.hidden, np.ones(lag), 'valid')[first]
            far = missed > allowed + _MORE * self.usual + most
            if far.any():
                at = int(first[far][0])
                return self._break(at, at + lag, stamps, xy)
        return None

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
    middle, usual = motion.yaw[:-1] + 0.5 * turned, period(stamps)
    stride = max(round(_STRIDE / max(usual, 1e-3)), 1)
    nothing = np.zeros(len(dt))
    swing = _swing(xy, middle, turned, motion)
    for said, has_speeds in _ways(dt, middle, motion):
        way = np.concatenate([np.zeros((1, 2)), np.cumsum(said, axis=0)])
        found = DeadReckoning(way, has_speeds, nothing, swing=swing)
        if found.is_trusted(xy, stride):
            hidden = (_hidden(dt, said, turned, motion) if has_speeds else
                      np.percentile(np.hypot(*np.diff(xy, axis=0).T), 90) * dt / usual)
            # Within a step a robot goes no farther astray than it drives, whatever the others say.
            astray = float(np.percentile(np.hypot(*said.T), 95)) if has_speeds else np.inf
            return replace(found, usual=min(found.usual_miss(xy), astray / _MORE),
                           hidden=np.where(dt > _LONG * usual, hidden, 0.0),
                           has_headings=_has_headings(found, middle, xy, stride))
    return None


def _has_headings(found: DeadReckoning, middle: Floats, xy: Floats, stride: int) -> bool:
    """Return whether headings are to be trusted, too, where the speeds may need none."""
    way = np.concatenate([np.zeros((1, 2)), np.cumsum(_heads(middle), axis=0)])
    return not found.has_speeds or replace(found, way=way, has_speeds=False).is_trusted(xy, stride)


def _swing(xy: Floats, middle: Floats, turned: Floats, motion: Motion) -> Floats | float:
    """Return how far ahead of its wheels a base is that swings aside in turns, as an offset."""
    if motion.velocity is not None and (motion.velocity[:, 1] != 0.0).any():
        return 0.0
    heads, steps = _heads(middle), np.diff(xy, axis=0)
    # The few largest may be corrections.
    turns = np.abs(turned) > max(0.5 * float(np.percentile(np.abs(turned), 95)), _TURNS)
    if turns.sum() < _FEWEST_STRIDES:
        return 0.0
    aside = (heads[:, 0] * steps[:, 1] - heads[:, 1] * steps[:, 0])[turns]
    ahead = float(np.clip(np.median(aside / turned[turns]), -_AHEAD, _AHEAD))
    left = np.abs(aside - ahead * turned[turns])
    is_so = np.median(left) < 0.5 * np.median(np.abs(aside))
    return ahead * _heads(motion.yaw) if is_so else 0.0


def _heads(yaw: Floats) -> Floats:
    return np.stack([np.cos(yaw), np.sin(yaw)], axis=1)


def _ways(dt: Floats, middle: Floats, motion: Motion) -> list[tuple[Floats, bool]]:
    """
    Return how far each step goes as the speeds say, and that these are speeds; else the headings.

    Some senders give speeds in the robot's frame, as they should, some in that of the places.
    """
    heads = _heads(middle)
    # One heading for all of a drive is none, but for a robot that says how it drives aside.
    by_heads = [(heads, False)] if np.ptp(motion.yaw) > _TURNS else []
    if motion.velocity is None:
        return by_heads
    mean = 0.5 * (motion.velocity[1:] + motion.velocity[:-1]) * dt[:, np.newaxis]
    left = np.stack([-heads[:, 1], heads[:, 0]], axis=1)
    return [(mean[:, :1] * heads + mean[:, 1:] * left, True), (mean, True), *by_heads]


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
