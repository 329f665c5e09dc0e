"""
Measure which broken drives are told from whole ones, and whether whole ones are kept.

``python -m benchmarks.broken_drives --drives 100``: made-up drives of a robot on wheels, with
poses 1 to 50 times a second, broken in ways that happen, and honest ones of robots that are not
perfect. The table has a row for each way; under each rate stand three counts: with speeds, with
headings alone, with places alone.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import ImplausibleDriveError
from control_field.drives.dead_reckoning import Motion
from control_field.drives.plausibility import DriveLimits, whole_drive

Floats = npt.NDArray[np.float64]
Rng = np.random.Generator

RATES: Final = (1.0, 2.0, 5.0, 20.0, 50.0)
_CELL: Final = 0.25
_TICK: Final = 0.01


@dataclass(frozen=True, eq=False)
class Poses:
    """
    What is recorded of a drive, and where the robot truly was.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
    xy, true_xy : ndarray, shape (n, 2), [m]
    yaw : ndarray, shape (n,), [rad]
    velocity : ndarray, shape (n, 3), [m/s], [m/s], [rad/s]
        Ahead, to the left, and turning.

    """

    stamps: Floats
    xy: Floats
    true_xy: Floats
    yaw: Floats
    velocity: Floats

    def at(self, index: npt.NDArray[np.int64] | npt.NDArray[np.bool_] | slice) -> 'Poses':
        """Return some of them."""
        return Poses(self.stamps[index], self.xy[index], self.true_xy[index], self.yaw[index],
                     self.velocity[index])

    def is_wrong(self, kept: npt.NDArray[np.int64]) -> bool:
        """Return whether some of the places are more than a cell off, seen from the last."""
        off = (self.xy - self.true_xy)[kept]
        return bool(np.hypot(*(off - off[-1]).T).max() > _CELL)


def drive(rng: Rng, seconds: float = 60.0, speed: float | None = None) -> Poses:
    """Return a robot that drives straight on, in arcs, turns on the spot and stops."""
    n, speed = int(seconds / _TICK), speed or float(rng.choice([0.15, 0.22, 0.3, 0.5]))
    wished = np.zeros((n, 2))
    at = int(rng.uniform(0.5, 2.0) / _TICK)
    while at < n:
        kind = rng.choice(4, p=[0.45, 0.3, 0.15, 0.1])
        much = rng.uniform(0.5, 1.0)
        wished[at:(at := at + int(rng.uniform(1.0, 5.0) / _TICK))] = (
            (speed * much, 0.0), (speed * much, rng.uniform(-0.6, 0.6)),
            (0.0, rng.choice([-1.0, 1.0])), (0.0, 0.0))[kind]
    v, w = _ramped(wished[:, 0], 0.5), _ramped(wished[:, 1], 2.0)
    return _driven(v, w, rng.uniform(-np.pi, np.pi))


def _ramped(wished: Floats, most: float) -> Floats:
    """Return speeds that change by so much a second at most."""
    done, now = np.empty(len(wished)), 0.0
    for i, wish in enumerate(wished.tolist()):
        now += float(np.clip(wish - now, -most * _TICK, most * _TICK))
        done[i] = now
    return done


def _driven(v: Floats, w: Floats, yaw: float) -> Poses:
    turned = yaw + np.cumsum(w) * _TICK
    steps = (v * _TICK)[:, np.newaxis] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    xy = np.cumsum(steps, axis=0)
    stamps = np.asarray(100.0 + np.arange(len(v)) * _TICK)
    return Poses(stamps, xy, xy.copy(), turned, np.stack([v, 0.0 * v, w], axis=1))


def sampled(poses: Poses, rate: float) -> Poses:
    """Return them so many times a second."""
    return poses.at(slice(None, None, round(1.0 / rate / _TICK)))


def _moved(poses: Poses, turn: float, start: int, to: Floats) -> Poses:
    """Return poses that from an index on are in another frame, in which that one is at ``to``."""
    c, s = np.cos(turn), np.sin(turn)
    xy, yaw = poses.xy.copy(), poses.yaw.copy()
    xy[start:] = to + (xy[start:] - xy[start]) @ np.array([[c, s], [-s, c]])
    yaw[start:] += turn
    return replace(poses, xy=xy, yaw=yaw)


def _some(rng: Rng, poses: Poses) -> int:
    return int(rng.uniform(0.15, 0.85) * len(poses.xy))


def _ahead(turn: float) -> Floats:
    return np.array([np.cos(turn), np.sin(turn)])


def reset(rng: Rng, poses: Poses) -> Poses:
    """Let odometry begin anew at its origin."""
    away = np.flatnonzero(np.hypot(*(poses.xy - poses.xy[0]).T) > 0.5)
    if not len(away):
        return poses
    start = int(rng.choice(away))
    return _moved(poses, -float(poses.yaw[start]), start, np.zeros(2))


def turned(rng: Rng, poses: Poses) -> Poses:
    """Turn the frame on the spot: a reset at home, or a compass that corrects."""
    start = _some(rng, poses)
    return _moved(poses, rng.choice([-1, 1]) * rng.uniform(0.8, np.pi), start, poses.xy[start])


def leap(size: float) -> Callable[[Rng, Poses], Poses]:
    """Return what lets places leap by so much, [m], and stay there."""
    def broken(rng: Rng, poses: Poses) -> Poses:
        """Let the place leap."""
        start = _some(rng, poses)
        to = poses.xy[start] + size * _ahead(rng.uniform(-np.pi, np.pi))
        return _moved(poses, 0.0, start, to)
    return broken


def spike(rng: Rng, poses: Poses) -> Poses:
    """Put one pose a metre off."""
    xy = poses.xy.copy()
    xy[_some(rng, poses)] += _ahead(rng.uniform(-np.pi, np.pi))
    return replace(poses, xy=xy)


def smear(size: float, seconds: float) -> Callable[[Rng, Poses], Poses]:
    """Return what lets places glide by so much, [m], within some seconds."""
    def broken(rng: Rng, poses: Poses) -> Poses:
        """Let the place glide away."""
        since = poses.stamps - poses.stamps[_some(rng, poses)]
        glide = size * np.clip(since / seconds, 0.0, 1.0)
        way = _ahead(rng.uniform(-np.pi, np.pi))
        return replace(poses, xy=poses.xy + glide[:, np.newaxis] * way)
    return broken


def hole(rng: Rng, poses: Poses) -> Poses:
    """Leave some seconds out, and a leap with them."""
    start = _some(rng, poses)
    gone = rng.uniform(3.0, 8.0)
    poses = leap(0.75)(rng, poses)
    since = poses.stamps - poses.stamps[start]
    return poses.at((since <= 0.0) | (since > gone))


def sources(rng: Rng, poses: Poses) -> Poses:
    """Make every other pose another robot's."""
    other = rng.permutation(len(poses.xy))[0] + np.arange(len(poses.xy))
    other %= len(poses.xy)
    xy = poses.xy.copy()
    xy[1::2] = (xy[other] + 1.5)[1::2]
    return replace(poses, xy=xy)


FAULTS: Final[dict[str, Callable[[Rng, Poses], Poses]]] = {
    'odometry reset': reset, 'frame turned': turned, 'leap 0.25 m': leap(0.25),
    'leap 0.5 m': leap(0.5), 'leap 1 m': leap(1.0), 'spike 1 m': spike,
    'smeared 0.5 m in 1 s': smear(0.5, 1.0), 'smeared 1 m in 1 s': smear(1.0, 1.0),
    'smeared 1 m in 3 s': smear(1.0, 3.0), 'smeared 2 m in 1 s': smear(2.0, 1.0),
    'hole with a leap': hole, 'two sources': sources}


def noisy(rng: Rng, poses: Poses) -> Poses:
    """Add noise to places, headings and speeds."""
    much = rng.uniform(0.0, 0.02)
    return replace(poses, xy=poses.xy + rng.normal(0.0, much, poses.xy.shape),
                   yaw=poses.yaw + rng.normal(0.0, much, poses.yaw.shape),
                   velocity=poses.velocity + rng.normal(0.0, much, poses.velocity.shape))


def scaled(rng: Rng, poses: Poses) -> Poses:
    """Measure the wheels badly."""
    return replace(poses, velocity=poses.velocity * rng.uniform(0.87, 1.18))


def lagging(rng: Rng, poses: Poses) -> Poses:
    """Filter the speeds, so that they are late."""
    n = int(rng.uniform(0.1, 0.4) / _TICK)
    kernel = np.ones(n) / n
    late = np.stack([np.convolve(each, kernel)[:len(each)] for each in poses.velocity.T], axis=1)
    return replace(poses, velocity=late)


def slipping(rng: Rng, poses: Poses) -> Poses:
    """Let wheels spin for some seconds: nothing moves."""
    start = _some(rng, poses)
    end = min(start + int(rng.uniform(1.0, 5.0) / _TICK), len(poses.xy) - 1)
    xy = poses.xy.copy()
    xy[end:] -= xy[end] - xy[start]
    xy[start:end] = xy[start]
    return replace(poses, xy=xy, true_xy=xy)


def corrected(rng: Rng, poses: Poses) -> Poses:
    """Correct the place by some centimetres and degrees every other second."""
    for start in range(200, len(poses.xy), 200):
        to = poses.xy[start] + rng.normal(0.0, 0.02, 2)
        poses = _moved(poses, float(rng.normal(0.0, 0.03)), start, to)
    return replace(poses, true_xy=poses.xy)


def drifting(rng: Rng, poses: Poses) -> Poses:
    """Pull places slowly to where they belong."""
    glide = np.outer(poses.stamps - 100.0, rng.uniform(-0.03, 0.03, 2))
    return replace(poses, xy=poses.xy + glide, true_xy=poses.xy + glide)


def offset(rng: Rng, poses: Poses) -> Poses:
    """Put the base beside the wheels' middle: it swings aside in turns."""
    lever = rng.uniform(-0.3, 0.3)
    c, s = np.cos(poses.yaw), np.sin(poses.yaw)
    xy = poses.xy + lever * np.stack([c, s], axis=1)
    velocity = poses.velocity.copy()
    velocity[:, 1] += rng.choice([0.0, lever]) * velocity[:, 2]
    return replace(poses, xy=xy, true_xy=xy, velocity=velocity)


def holonomic(rng: Rng, poses: Poses) -> Poses:
    """Drive sideways and look ahead; perhaps say how fast."""
    yaw = np.full(len(poses.yaw), rng.uniform(-np.pi, np.pi))
    steps = np.gradient(poses.xy, _TICK, axis=0)
    c, s = np.cos(yaw), np.sin(yaw)
    ahead, left = c * steps[:, 0] + s * steps[:, 1], -s * steps[:, 0] + c * steps[:, 1]
    velocity = rng.choice([0.0, 1.0]) * np.stack([ahead, left, 0.0 * left], axis=1)
    return replace(poses, yaw=yaw, velocity=velocity)


def lossy(rng: Rng, poses: Poses) -> Poses:
    """Lose messages, and let stamps jitter."""
    kept = poses.at(rng.uniform(size=len(poses.xy)) > rng.uniform(0.05, 0.3))
    apart = float(np.median(np.diff(poses.stamps)))
    return replace(kept, stamps=kept.stamps + rng.uniform(-0.2, 0.2, len(kept.stamps)) * apart)


def hasty(rng: Rng, poses: Poses) -> Poses:
    """Creep, and drive fast for some seconds."""
    v, w = poses.velocity[:, 0] * 0.3, poses.velocity[:, 2]
    start = _some(rng, poses)
    v[start:start + int(rng.uniform(3.0, 8.0) / _TICK)] = rng.uniform(0.3, 0.6)
    return _driven(_ramped(v, 0.5), w, 0.0)


def backing(rng: Rng, poses: Poses) -> Poses:
    """Drive backwards half of the time."""
    sign = np.where(np.sin(poses.stamps / rng.uniform(1.0, 5.0)) > 0.0, 1.0, -1.0)
    return _driven(_ramped(poses.velocity[:, 0] * sign, 0.5), poses.velocity[:, 2], 0.0)


def by_the_way(rng: Rng, poses: Poses) -> Poses:
    """Drive backwards, too, with a heading that is made from the way it goes."""
    poses = backing(rng, poses)
    return replace(poses, yaw=poses.yaw + np.where(poses.velocity[:, 0] < 0.0, np.pi, 0.0),
                   velocity=np.abs(poses.velocity))


def sudden(rng: Rng, poses: Poses) -> Poses:
    """Drive without inertia: speeds are what was asked, stops are at once."""
    v = np.where(rng.uniform(size=len(poses.xy) // 50 + 1) < 0.5, 0.0, 0.6)
    w = np.where(v > 0.0, 0.0, rng.choice([-2.8, 0.0, 2.8], len(v)))
    v, w = (np.repeat(each, 50)[:len(poses.xy)] for each in (v, w))
    return _driven(v, w, 0.0)


def fast(rng: Rng, _: Poses) -> Poses:
    """Drive with 1 to 2.5 m/s."""
    return drive(rng, speed=float(rng.uniform(1.0, 2.5)))


#: By name, with whether it is done before poses are chosen.
HONEST: Final[dict[str, tuple[Callable[[Rng, Poses], Poses], bool]]] = {
    'as it is': (lambda _, poses: poses, True), 'noise': (noisy, False), 'bad wheels':
    (scaled, True), 'filtered speeds': (lagging, True), 'wheels spin': (slipping, True),
    'small corrections': (corrected, True), 'drift': (drifting, True),
    'base aside': (offset, True), 'sideways': (holonomic, True), 'lost messages': (lossy, False),
    'creeps, then hastes': (hasty, True), 'backwards, too': (backing, True),
    'heading of the way': (by_the_way, True), 'no inertia': (sudden, True), 'fast': (fast, True)}


def judged(poses: Poses, channel: int) -> tuple[bool, bool, bool, bool]:
    """
    Judge a drive by what came with its places.

    Parameters
    ----------
    poses : Poses
    channel : int
        0 with speeds, 1 with headings, 2 with neither.

    Returns
    -------
    tuple of bool
        Whether it is refused; whether what is kept is wrong; whether that it may be is said in
        sentences; and whether at least in the numbers.

    """
    motion = Motion(poses.yaw, poses.velocity[:, :2]) if channel == 0 else Motion(
        poses.yaw if channel == 1 else 0.0 * poses.yaw)
    try:
        found = whole_drive(poses.stamps, poses.xy, DriveLimits(_CELL), motion)
    except ImplausibleDriveError:
        return True, False, False, False
    return (False, poses.is_wrong(found.kept), bool(found.doubts),
            bool(found.doubts or found.missing_evidence))


def _row(name: str, n_drives: int, make: Callable[[Rng, float], Poses]) -> tuple[str, str]:
    """Return counts of drives refused (doubted), and of those kept though wrong (unsaid)."""
    refused, wrong = [], []
    for rate in RATES:
        counts = np.zeros((4, 3), dtype=int)
        for seed in range(n_drives):
            poses = make(np.random.default_rng([seed, int(rate)]), rate)
            for channel in range(3):
                is_refused, is_wrong, is_doubted, is_said = judged(poses, channel)
                counts[:, channel] += (
                    is_refused, is_doubted, is_wrong, is_wrong and not is_said)
        refused.append(_texts(counts[:2]))
        wrong.append(_texts(counts[2:]))
    return (f'{name:22}' + ''.join(f'{each:>20}' for each in refused),
            f'{name:22}' + ''.join(f'{each:>20}' for each in wrong))


def _texts(counts: npt.NDArray[np.int64]) -> str:
    return '/'.join(f'{n}({m})' if n or m else '0' for n, m in counts.T.tolist())


def _broken(fault: Callable[[Rng, Poses], Poses]) -> Callable[[Rng, float], Poses]:
    return lambda rng, rate: fault(rng, sampled(drive(rng), rate))


def _honest(change: Callable[[Rng, Poses], Poses], is_before: bool) -> Callable[
        [Rng, float], Poses]:
    if is_before:
        return lambda rng, rate: sampled(change(rng, drive(rng)), rate)
    return lambda rng, rate: change(rng, sampled(drive(rng), rate))


def main() -> int:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--drives', type=int, default=60, help='in each field (%(default)s)')
    n = parser.parse_args().drives
    print(f'{n} drives each; poses a second: {RATES}; with speeds/headings/places alone')
    print('honest drives that are refused (kept, and something is in doubt):')
    for name, (change, is_before) in HONEST.items():
        print(_row(name, n, _honest(change, is_before))[0], flush=True)
    print('broken drives that are kept and more than a cell off (and nothing is said):')
    for name, fault in FAULTS.items():
        print(_row(name, n, _broken(fault))[1], flush=True)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
