"""
Whether a robot can have driven what its poses say, and which part of it is whole.

A drive is learnt only where it is known: poses that leap, stamps that go back or stand, seconds
that are missing and two sources on one topic break it. It is cut at the break, and a part is kept
where beginning and goal are certain; everything else is refused. ``doc/adr/0011`` has the reasons.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import (
    Break, break_between, BreakKind, ImplausibleDriveError, place_text)
from control_field.drives.dead_reckoning import DeadReckoning, Motion, reckoned
from control_field.drives.doubts import first_doubt, haste, missing_evidence, unseen
from control_field.drives.short_holes import led_across, sentence_on_holes
from control_field.drives.speeds import MOST_SPIKES, period, speed_bound
from control_field.drives.turned_frame import turned_frames
from control_field.drives.two_sources import two_sources
from control_field.words import counted

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

#: Faster than this is no robot that is taught by driving, where nobody says what it can, [m/s].
SPEED_MAX: Final = 3.0
#: How far a pose may be off beyond that, [m]: localisation that corrects itself; as in a trial.
#: In large cells it may be this share of one.
POSE_JUMP: Final = 0.1
_JUMP_OF_CELL: Final = 0.4
#: Time without a pose that is a hole: so many times the usual one, and at least so much, [s].
_RARE, _LEAST_HOLE = 5.0, 0.5
#: At most so many poses in a row are poses gone wrong rather than another drive.
_SPIKE_LENGTH: Final = 3
#: Share of a cell that a robot which stands still may seem to move.
_STILL: Final = 0.4
#: A step of the stamps back that is no message which came late, [s].
_CLOCK_JUMP: Final = 0.5


@dataclass(frozen=True)
class DriveLimits:
    """
    What a drive may be.

    Parameters
    ----------
    cell : float, [m]
        Side of a cell: what is not known within one is no loss.
    speed_max : float, [m/s]
        The robot is no faster.

    """

    cell: float
    speed_max: float = SPEED_MAX

    @property
    def pose_jump(self) -> float:
        """Return how far a pose may be off beyond what the robot can drive, [m]."""
        return max(POSE_JUMP, _JUMP_OF_CELL * self.cell)

    @property
    def unknown_way(self) -> float:
        """Return how far nobody needs to know the way, [m]: a cell, or twice a pose jump."""
        return max(self.cell, 2.0 * self.pose_jump)

    @property
    def still(self) -> float:
        """Return how far a robot that stands may seem to move, [m]."""
        return max(_STILL * self.cell, 0.5 * self.pose_jump)


@dataclass(frozen=True, eq=False)
class WholeDrive:
    """
    What is kept of the poses of a drive.

    Parameters
    ----------
    kept : ndarray of int64, shape (k,)
        Indices of the poses, in order of time.
    spikes : tuple of Break
        Where poses that are far off all others were left out, ``index`` of the first of each.
    n_spikes : int
        How many poses that were.
    early : Break or None
        Where the drive begins, if the robot was said to stand elsewhere before.
    n_early : int
        How many poses before that were left out.
    doubts : tuple of str
        What nobody can tell of what is kept.
    missing_evidence : str
        What did not help to tell that; empty if all there can be did.

    """

    kept: Indices
    spikes: tuple[Break, ...] = ()
    n_spikes: int = 0
    early: Break | None = None
    n_early: int = 0
    doubts: tuple[str, ...] = ()
    missing_evidence: str = ''

    def sentences(self) -> list[str]:
        """Say what was left out, when and where, and what is in doubt."""
        said = [f'1 pose is far off the others at {spike.at:.2f} s, at {place_text(spike.after)}, '
                f'and is left out' for spike in self.spikes]
        if self.n_spikes > len(self.spikes):
            said.append(f'{self.n_spikes} poses are left out in all')
        if self.early is not None:
            said.append(f'{counted(self.n_early, "pose")} before the drive left out: {self.early}')
        return [*said, *self.doubts]


def whole_drive(
    stamps: Floats, xy: Floats, limits: DriveLimits, motion: Motion | None = None,
) -> WholeDrive:
    """
    Return the poses of a drive that belong together.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
        In the order in which they were recorded, finite; late and doubled ones do no harm.
    xy : ndarray, shape (n, 2), [m]
        Finite.
    limits : DriveLimits
    motion : Motion, optional
        What came with each; it counts where it fits most of the drive.

    Raises
    ------
    ImplausibleDriveError
        If no part of it is whole.

    """
    drive = _whole_poses(stamps, xy, limits, motion)
    kept = drive.kept
    return drive if motion is None or len(kept) < 2 else _in_doubt(
        drive, stamps[kept], xy[kept], limits, motion.at(kept))


def _whole_poses(
    stamps: Floats, xy: Floats, limits: DriveLimits, motion: Motion | None,
) -> WholeDrive:
    """Return the poses that belong together, whatever is in doubt."""
    order = np.argsort(stamps, kind='stable').astype(np.int64)
    if len(stamps) < 2:
        return WholeDrive(order)
    found = breaks_of(stamps[order], xy[order], limits, _at(motion, order))
    clean, spikes = _without_spikes(stamps, xy, order, limits, motion) if found else (order, ())
    rest = breaks_of(stamps[clean], xy[clean], limits, _at(motion, clean)) if spikes else found
    sources = two_sources(stamps[order], xy[order], bool(found), limits.pose_jump)
    # A clock that was set back mixes pieces of one drive; in the order recorded they are apart.
    back = _set_back(stamps, xy, rest or sources)
    if back and not two_sources(stamps, xy, bool(found), limits.pose_jump):
        return _last_part(stamps, xy, np.arange(len(stamps)), back, limits, motion)
    if sources is not None:
        raise ImplausibleDriveError([sources])
    if rest:
        return _last_part(stamps, xy, clean, rest, limits, motion)
    return WholeDrive(clean, spikes, len(order) - len(clean))


def breaks_of(
    stamps: Floats, xy: Floats, limits: DriveLimits, motion: Motion | None = None,
) -> list[Break]:
    """
    Return where poses in order of time are not one drive.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
        Not decreasing.
    xy : ndarray, shape (n, 2), [m]
    limits : DriveLimits
    motion : Motion, optional
        What came with each; it counts where it fits most of the drive.

    """
    if len(stamps) < 2:
        return []
    said = None if motion is None else reckoned(stamps, xy, motion)
    found = {each.index: each for each in (
        *_unsaid(stamps, xy, limits, motion, said), *_standing(stamps, xy, limits),
        *_leaps(stamps, xy, limits, motion, said))}
    return [found[index] for index in sorted(found)] or _too_fast(stamps, xy, limits)


def _in_doubt(
    drive: WholeDrive, stamps: Floats, xy: Floats, limits: DriveLimits, motion: Motion,
) -> WholeDrive:
    """Add what nobody can tell of what is kept of a drive, in order of time."""
    said = reckoned(stamps, xy, motion)
    glide = None if said is None else said.glide(stamps, xy, limits.unknown_way)
    leap = limits.pose_jump + speed_bound(stamps, xy, limits.speed_max) * period(stamps)
    if said is not None and said.has_speeds:
        leap = said.unseen(limits.pose_jump)
    elif glide is None:
        glide = haste(stamps, xy, limits.pose_jump)
    turned = [each for each in _turned(stamps, xy, motion, said) if each.is_doubt]
    doubts = (
        sentence_on_holes(stamps, xy, np.flatnonzero(_holes(stamps, xy, limits))),
        first_doubt(turned), first_doubt([] if glide is None else [glide]), unseen(
            period(stamps), leap if leap > limits.unknown_way else 0.0, said))
    return replace(drive, doubts=tuple(filter(None, doubts)),
                   missing_evidence=missing_evidence(said))


def _unsaid(
    stamps: Floats, xy: Floats, limits: DriveLimits, motion: Motion | None,
    said: DeadReckoning | None,
) -> list[Break]:
    """Return where places do not fit the headings and speeds that came with them."""
    if motion is None or said is None:
        return []
    turned = [each for each in _turned(stamps, xy, motion, said) if not each.is_doubt]
    return [*turned, *said.leaps(stamps, xy, limits.pose_jump)]


def _turned(
    stamps: Floats, xy: Floats, motion: Motion, said: DeadReckoning | None,
) -> list[Break]:
    """Return where the frame turns, if headings tell."""
    if said is None or not said.has_headings:
        return []
    return turned_frames(stamps, xy, motion.yaw, said.swing)


def _leaps(
    stamps: Floats, xy: Floats, limits: DriveLimits, motion: Motion | None,
    said: DeadReckoning | None,
) -> list[Break]:
    """Return the steps that are too far for their time, and those nobody knows the way of."""
    dt, way = np.diff(stamps), _way(xy)
    reach = limits.pose_jump + _speed(stamps, xy, limits, said) * dt
    leaps = (way > reach) & (dt > 0.0)
    holes = _holes(stamps, xy, limits) & ~leaps & ~led_across(stamps, xy, motion, said)
    return [break_between(BreakKind.LEAP if leaps[i] else BreakKind.HOLE, i, i + 1, stamps, xy,
                   float(reach[i])) for i in np.flatnonzero(leaps | holes).tolist()]


def _holes(stamps: Floats, xy: Floats, limits: DriveLimits) -> npt.NDArray[np.bool_]:
    """Return the steps that last too long to know the way, if the robot moved on."""
    return np.asarray((np.diff(stamps) > max(_RARE * period(stamps), _LEAST_HOLE))
                      & (_way(xy) > limits.unknown_way))


def _speed(
    stamps: Floats, xy: Floats, limits: DriveLimits, said: DeadReckoning | None,
) -> float:
    """Return how fast a step may be, [m/s]; where speeds came with it they tell all else."""
    return (limits.speed_max if said is not None and said.has_speeds else
            speed_bound(stamps, xy, limits.speed_max))


def _standing(stamps: Floats, xy: Floats, limits: DriveLimits) -> list[Break]:
    """Return where one stamp has poses too far apart."""
    found = []
    changes = np.flatnonzero(np.diff(stamps, prepend=-np.inf, append=np.inf) > 0.0)
    for i in np.flatnonzero(np.diff(changes) > 1).tolist():
        first, end = int(changes[i]), int(changes[i + 1])
        away = np.hypot(*(xy[first:end] - xy[first]).T)
        if away.max() > limits.pose_jump:
            kind = BreakKind.STANDING if end - first > 2 else BreakKind.LEAP
            found.append(break_between(kind, first, first + int(away.argmax()), stamps, xy,
                                limits.pose_jump))
    return found


def _too_fast(stamps: Floats, xy: Floats, limits: DriveLimits) -> list[Break]:
    """Return where many small steps together are faster than the robot; one place is enough."""
    lag = 2
    while lag < len(stamps):
        dt, way = stamps[lag:] - stamps[:-lag], np.hypot(*(xy[lag:] - xy[:-lag]).T)
        reach = limits.pose_jump + limits.speed_max * dt
        if (way > reach).any():
            first = int((way > reach).argmax())
            return [break_between(
                BreakKind.FAST, first, first + lag, stamps, xy, float(reach[first]))]
        lag *= 2
    return []


def _set_back(stamps: Floats, xy: Floats, is_broken: object) -> list[Break]:
    """
    Return where stamps go back, in the order recorded, by more than messages are late.

    Where they make a drive nevertheless, those count that all that follows stays behind: sorted
    by stamp the end of such a drive would come before its beginning.
    """
    steps = np.flatnonzero(np.diff(stamps) < -_CLOCK_JUMP).tolist()
    if not is_broken:
        steps = [i for i in steps if len(stamps) - i > 1 + _SPIKE_LENGTH
                 and stamps[i + 1:].max() < stamps[:i + 1].max() - _CLOCK_JUMP]
    return [replace(break_between(BreakKind.BACK, i, i + 1, stamps, xy),
                    at=float(stamps[i] - stamps[0])) for i in steps]


def _without_spikes(
    stamps: Floats, xy: Floats, order: Indices, limits: DriveLimits, motion: Motion | None,
) -> tuple[Indices, tuple[Break, ...]]:
    """Leave poses out that are far off those before and after, where these fit together."""
    at, places = stamps[order], xy[order]
    said = None if motion is None else reckoned(at, places, motion.at(order))
    speed = _speed(at, places, limits, said)

    def fits(i: int, j: int) -> bool:
        reach = limits.pose_jump + speed * float(at[j] - at[i])
        return math.dist(places[i], places[j]) <= reach and (
            said is None or said.fits(places, i, j, limits.pose_jump))

    kept, i = [0], 1
    spikes: list[Break] = []
    while i < len(order):
        last = kept[-1]
        if not fits(last, i):
            ahead = range(i + 1, min(i + 1 + _SPIKE_LENGTH, len(order)))
            # It leaps back, too: what goes on from where it leapt to is another frame.
            after = next((j for j in ahead if fits(last, j) and not fits(j - 1, j) and _is_known(
                at[[last, j]], places[[last, j]], limits)), None)
            if after is None and len(order) - i <= _SPIKE_LENGTH and _is_soon(at[[last, -1]]):
                after = len(order)  # the robot is still where it was a moment before
            if after is None or len(spikes) == MOST_SPIKES:
                return order, ()
            spikes.append(break_between(BreakKind.LEAP, last, i, at, places))
            i = after
            continue
        kept.append(i)
        i += 1
    return order[np.array(kept, dtype=np.int64)], tuple(spikes)


def _is_known(at: Floats, places: Floats, limits: DriveLimits) -> bool:
    """Return whether no way is lost between two poses."""
    return _is_soon(at) or math.dist(*places) <= limits.unknown_way


def _is_soon(at: Floats) -> bool:
    return bool(at[1] - at[0] <= _LEAST_HOLE)


def _last_part(
    stamps: Floats, xy: Floats, order: Indices, breaks: list[Break], limits: DriveLimits,
    motion: Motion | None,
) -> WholeDrive:
    """Return the part after the last break, if the robot only stood before; else refuse."""
    starts = [0, *(found.index for found in breaks)]
    rest = order[starts[-1]:]
    rest = rest[np.argsort(stamps[rest], kind='stable')]
    # In a hole the robot did not stand: the drive begins somewhere in it.
    if (len(rest) < 2 or len(breaks) > MOST_SPIKES
            or any(found.kind is BreakKind.HOLE for found in breaks)
            or breaks_of(stamps[rest], xy[rest], limits, _at(motion, rest))):
        raise ImplausibleDriveError(breaks)
    for start, end in pairwise(starts):
        places = xy[order[start:end]]
        if np.hypot(*(places - places[:1]).T).max(initial=0.0) > limits.still:
            raise ImplausibleDriveError(breaks)
    return WholeDrive(rest, early=breaks[-1], n_early=len(stamps) - len(rest))


def _at(motion: Motion | None, index: Indices) -> Motion | None:
    return None if motion is None else motion.at(index)


def _way(xy: Floats) -> Floats:
    return np.asarray(np.hypot(*np.diff(xy, axis=0).T))
