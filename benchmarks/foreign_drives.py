"""
Learn made-up bags of others with the defaults alone: what becomes of each kind of drive.

``python -m benchmarks.foreign_drives --drives 3``: a row for each kind, with how many drives were
learnt right, right with something said, refused, and wrong. Right is: the goal is within a cell of
where the drive ended, and path and way driven are nowhere more than a cell apart.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
import math
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from benchmarks.broken_drives import drive, Poses
from benchmarks.foreign_bags import BagWriter
from control_field.grid import cell_side, default_lattice
from episode_store.external.drive import open_drive, ReadOptions
from episode_store.external.import_drive import demonstration_from_drive
from episode_store.external.workspace import Workspace
from episode_store.rosbag2.errors import BagError

Floats = npt.NDArray[np.float64]
Rng = np.random.Generator

_SIDE: Final = cell_side(0.105)
#: Places that lie so far apart, [m], are looked at of a way.
_APART: Final = 0.05
#: What has to become of a kind.
_MUST: Final = {False: 'right', True: 'refused', None: 'either, never wrong'}
#: A robot becomes faster by so much, [m/s^2].
_HASTE: Final = 2.0
#: A drive to be learnt ends at least so far from where it began, [m].
_LEAST: Final = 1.0


def some_drive(rng: Rng, rate: float = 20.0, seconds: float = 40.0, speed: float = 0.4) -> Poses:
    """Return poses of a drive that ends elsewhere than it began, so many times a second."""
    while True:
        poses = drive(rng, seconds, speed)
        poses = replace(poses, xy=poses.xy - poses.xy[0])
        if np.hypot(*poses.xy[-1]) > _LEAST:
            return poses.at(slice(None, None, round(100.0 / rate)))


def moved(poses: Poses, x: float, y: float, turn: float = 0.0) -> Poses:
    """Return them in a frame in which its origin lies elsewhere, turned."""
    c, s = math.cos(turn), math.sin(turn)
    return replace(poses, xy=poses.xy @ np.array([[c, s], [-s, c]]) + [x, y],
                   yaw=poses.yaw + turn)


def straight(length: float, speed: float, rate: float = 20.0) -> Poses:
    """Return a drive in a long bend, with a second of standing at either end."""
    n = int((length / speed + 2.0 * speed / _HASTE + 2.0) * rate)
    at = np.arange(n) / rate
    ramp = np.clip(_HASTE * np.minimum(at - 1.0, at[-1] - 1.0 - at), 0.0, speed)
    ramp *= length / (ramp.sum() / rate)
    way = np.cumsum(ramp) / rate
    yaw = 0.3 * np.sin(3.0 * way / length)
    xy = np.cumsum((ramp / rate)[:, np.newaxis] * np.stack([np.cos(yaw), np.sin(yaw)], 1), axis=0)
    return Poses(100.0 + at, xy, xy, yaw, np.stack([ramp, 0.0 * ramp, 0.0 * ramp], axis=1))


@dataclass(frozen=True)
class Kind:
    """
    A kind of bag.

    Parameters
    ----------
    write : callable
        Writes the bag; returns the places driven in the frame that is learnt, [m].
    is_refused : bool or None
        Whether it must not be learnt; None where either will do.
    says : str
        What has to be said of it.
    speed_max : float, [m/s]
        Given by the user.
    side : float, [m]
        Of the cells.
    storage : str
        How the bag is stored, see `BagWriter`.

    """

    write: Callable[[BagWriter, Rng], Floats]
    is_refused: bool | None = False
    says: str = ''
    speed_max: float = 3.0
    side: float = _SIDE
    storage: str = 'mcap'


def odometry(change: Callable[[Poses, Rng], Poses] = lambda poses, _: poses, rate: float = 20.0,
             **values: Any) -> Callable[[BagWriter, Rng], Floats]:
    """Return a writer of odometry alone."""
    def write(bag: BagWriter, rng: Rng) -> Floats:
        poses = change(some_drive(rng, rate), rng)
        bag.odometry(poses, **values)
        return poses.xy
    return write


def of(poses: Poses, **values: Any) -> Callable[[BagWriter, Rng], Floats]:
    """Return a writer of the odometry of one drive."""
    def write(bag: BagWriter, _: Rng) -> Floats:
        bag.odometry(poses, **values)
        return poses.xy
    return write


def frames(with_map: bool) -> Callable[[BagWriter, Rng], Floats]:
    """Return a writer of `/tf` alone, perhaps below a map's frame that is corrected."""
    def write(bag: BagWriter, rng: Rng) -> Floats:
        poses = some_drive(rng)
        for i in range(0, len(poses.stamps), 10) if with_map else ():
            bag.transform('map', 'odom', poses.stamps[i], 5.0 + 1e-4 * i, -3.0, 0.5)
        bag.transforms('odom', 'base_footprint', poses)
        return poses.xy
    return write


def stamped(kind: str, topic: str, frame: str, rate: float, has_headings: bool = True) -> (
        Callable[[BagWriter, Rng], Floats]):
    """Return a writer of poses without speeds."""
    def write(bag: BagWriter, rng: Rng) -> Floats:
        poses = moved(some_drive(rng, rate), -7.0, 4.0, 1.0)
        bag.poses(poses, kind, topic, frame, has_headings=has_headings)
        return poses.xy
    return write


def three_sources(bag: BagWriter, rng: Rng) -> Floats:
    """Write odometry, `/tf` with a map, and the pose of a localisation."""
    poses = some_drive(rng)
    bag.odometry(poses)
    bag.transforms('odom', 'base_footprint', poses)
    bag.poses(moved(poses.at(slice(None, None, 10)), 3.0, 2.0), 'PoseWithCovarianceStamped',
              '/amcl_pose', 'map')
    bag.poses(moved(poses.at(slice(0, 1)), 9.0, 9.0), 'PoseStamped', '/goal_pose', 'map')
    return poses.xy


def wheels_and_filter(bag: BagWriter, rng: Rng) -> Floats:
    """Write two kinds of odometry, one of which is in `/tf`."""
    poses = some_drive(rng)
    bag.odometry(moved(poses, 0.0, 0.0, 0.3), topic='/odometry/wheels')
    bag.odometry(poses, topic='/odometry/filtered')
    bag.transforms('odom', 'base_link', poses)
    return poses.xy


def standing_and_moving(bag: BagWriter, rng: Rng) -> Floats:
    """Write odometry that never moves, and poses without stamps, new once a second."""
    poses = moved(some_drive(rng, speed=1.0), 369_644.7, 3_280_416.6)
    still = replace(poses, xy=0.0 * poses.xy, velocity=0.0 * poses.velocity)
    bag.odometry(still, topic='/odometry', frame='chassis')
    held = poses.at(np.arange(len(poses.stamps)) // 20 * 20)
    bag.poses(replace(held, stamps=poses.stamps), 'PoseStamped', '/vehicle_pose', 'utm',
              is_stamped=False)
    return held.xy


def optical(bag: BagWriter, rng: Rng) -> Floats:
    """Write visual odometry in a camera's frame: x to the right, y down, z ahead."""
    poses = some_drive(rng)
    bag.odometry(poses, topic='/visual_odom', frame='camera_optical', axes=(1, 2, 0))
    return poses.xy


def ned(bag: BagWriter, rng: Rng) -> Floats:
    """Write odometry with x north, y east, z down."""
    poses = some_drive(rng)
    poses = replace(poses, xy=poses.xy * [1.0, -1.0], yaw=-poses.yaw)
    bag.odometry(poses, frame='map_ned')
    return poses.xy


def flight(bag: BagWriter, rng: Rng) -> Floats:
    """Write the odometry of a drone: up by 3 m, along, and down."""
    poses = some_drive(rng)
    share = np.linspace(0.0, 1.0, len(poses.stamps))
    along = np.clip((share - 0.2) / 0.6, 0.0, 1.0) * (len(share) - 1)
    poses = replace(poses.at(along.astype(int)), stamps=poses.stamps)
    bag.odometry(poses, z=3.0 * np.clip(5.0 * np.minimum(share, 1.0 - share), 0.0, 1.0))
    return poses.xy


def hills(bag: BagWriter, rng: Rng) -> Floats:
    """Write a drive over bumpy hills."""
    poses = some_drive(rng)
    bag.odometry(poses, z=0.2 * poses.xy[:, 0] + rng.normal(0.0, 0.02, len(poses.xy)))
    return poses.xy


def walking(poses: Poses, _: Rng) -> Poses:
    """Sway as what walks does."""
    sway = 0.03 * np.sin(8.0 * poses.stamps)
    aside = np.stack([-np.sin(poses.yaw), np.cos(poses.yaw)], axis=1)
    return replace(poses, xy=poses.xy + sway[:, np.newaxis] * aside)


def gripper(bag: BagWriter, rng: Rng) -> Floats:
    """Write the poses of an arm's hand."""
    t = np.arange(0.0, 40.0, 0.05)
    xy = 0.4 * np.stack([np.cos(t / 3.0), np.sin(t / 4.0)], axis=1)
    hand = Poses(100.0 + t, xy, xy, 0.3 * t, np.zeros((len(t), 3)))
    bag.poses(hand, 'PoseStamped', '/tool', 'world', z=0.5 + 0.4 * np.sin(t))
    return xy


def sideways(poses: Poses, _: Rng) -> Poses:
    """Let it look one way and go all ways."""
    return replace(poses, yaw=poses.yaw + 1.6 * np.sin(poses.stamps / 3.0),
                   velocity=0.0 * poses.velocity)


def there_and_back(poses: Poses, _: Rng) -> Poses:
    """Drive the way back again."""
    n = len(poses.stamps)
    order = np.concatenate([np.arange(n), np.arange(n)[::-1]])
    back = poses.at(order)
    return replace(back, stamps=np.linspace(100.0, 100.0 + 0.1 * n, 2 * n), velocity=np.where(
        np.arange(2 * n)[:, np.newaxis] < n, 1.0, -1.0) * back.velocity)


def stood(poses: Poses, _: Rng) -> Poses:
    """Stand for minutes before and after."""
    index = np.concatenate([np.zeros(2000, int), np.arange(len(poses.stamps)),
                            np.full(2000, len(poses.stamps) - 1)])
    found = poses.at(index)
    velocity = found.velocity.copy()
    velocity[:2000] = velocity[-2000:] = 0.0
    stamps = np.linspace(100.0, 100.0 + 0.05 * len(index), len(index))
    return replace(found, stamps=stamps, velocity=velocity)


def doubled(poses: Poses, _: Rng) -> Poses:
    """Send every message twice."""
    return poses.at(np.repeat(np.arange(len(poses.stamps)), 2))


def holed(seconds: float) -> Callable[[Poses, Rng], Poses]:
    """Return what loses the messages of some seconds in which it drives straight on."""
    def change(_: Poses, __: Rng) -> Poses:
        poses = straight(12.0, 0.4)
        return poses.at((poses.stamps < 112.0) | (poses.stamps > 112.0 + seconds))
    return change


def reset(poses: Poses, _: Rng) -> Poses:
    """Let odometry begin anew at its origin."""
    half = len(poses.stamps) // 2
    xy = poses.xy.copy()
    xy[half:] += 1.5 - xy[half]
    return replace(poses, xy=xy)


def two_robots(bag: BagWriter, rng: Rng) -> Floats:
    """Write the odometry of two robots."""
    for name in 'ab':
        bag.odometry(some_drive(rng), topic=f'/{name}/odom')
    return np.zeros((1, 2))


def no_poses(bag: BagWriter, _: Rng) -> Floats:
    """Write commands alone."""
    bag.commands(100)
    return np.zeros((1, 2))


def later(poses: Poses, rng: Rng) -> Poses:
    """Record some messages after those that were sent after them."""
    order = np.argsort(np.arange(len(poses.stamps)) + rng.uniform(0.0, 3.0, len(poses.stamps)))
    return poses.at(order)


def spiked(bag: BagWriter, rng: Rng) -> Floats:
    """Put one pose a million metres off."""
    poses = some_drive(rng)
    xy = poses.xy.copy()
    xy[len(xy) // 2] += 1e6
    bag.odometry(replace(poses, xy=xy))
    return poses.xy


KINDS: Final[dict[str, Kind]] = {
    'odometry alone': Kind(odometry()),
    'sqlite3': Kind(odometry(), storage='sqlite3'), 'ROS 1': Kind(odometry(), storage='ros1'),
    'split in files': Kind(odometry(), storage='split'),
    '10 Hz': Kind(odometry(rate=10.0)), '400 Hz': Kind(of(straight(8.0, 0.4, 400.0))),
    'another name and frame': Kind(odometry(topic='/robot/wheels', frame='robot/odom_combined')),
    'frame without a name': Kind(odometry(frame='')),
    '/tf alone': Kind(frames(False)), '/tf below a map': Kind(frames(True)),
    'PoseStamped in map': Kind(stamped('PoseStamped', '/slam/pose', 'map', 20.0)),
    'quaternions of zeros': Kind(stamped('PoseStamped', '/fix', 'utm', 20.0, False), says='looks'),
    'localisation, 2 Hz': Kind(stamped('PoseWithCovarianceStamped', '/amcl_pose', 'map', 2.0)),
    'odometry, map, goal': Kind(three_sources),
    'wheels and a filter': Kind(wheels_and_filter, says='/odometry/filtered, the only one that'),
    'standing odometry, GPS': Kind(standing_and_moving, says='stands still'),
    '500 km away': Kind(odometry(lambda poses, _: moved(poses, 5e5, -4.9e6, 2.0))),
    '0.5 m': Kind(of(straight(0.5, 0.2))),
    '0.1 m': Kind(of(straight(0.1, 0.1)), is_refused=True, says='--resolution 0.03'),
    '0.1 m, small cells': Kind(of(straight(0.1, 0.1)), side=0.03),
    '400 m at 1 m/s': Kind(of(straight(400.0, 1.0))),
    '400 m at 10 m/s': Kind(of(straight(400.0, 10.0)), True, '--max-speed 1'),
    '400 m at 10 m/s, allowed': Kind(of(straight(400.0, 10.0)), speed_max=13.0),
    'no stamps': Kind(odometry(is_stamped=False), says='bears a stamp'),
    'simulated time': Kind(odometry(lambda poses, _: replace(
        poses, stamps=poses.stamps - 100.0), wall=1.7e9)),
    'doubled messages': Kind(odometry(doubled)), 'late messages': Kind(odometry(later)),
    'minutes of standing': Kind(odometry(stood)),
    'there and back': Kind(odometry(there_and_back), True, '--to '),
    'hole of 1.5 s': Kind(odometry(holed(1.5)), says='filled in'),
    'hole of 5 s': Kind(odometry(holed(5.0)), True, '--from'),
    'odometry reset': Kind(odometry(reset), True, '--from'),
    'one pose far off': Kind(spiked, says='far off'),
    'sideways': Kind(odometry(sideways), says='sideways'),
    'camera axes': Kind(optical, True, '--frame'), 'north, east, down': Kind(ned, says='NED'),
    'hills': Kind(hills), 'on legs': Kind(odometry(walking)),
    'drone': Kind(flight, None), 'arm': Kind(gripper, True, '--odom-topic'),
    'two robots': Kind(two_robots, True, '--odom-topic'), 'no poses': Kind(no_poses, True, 'none')}


def outcome(path: Path, kind: Kind, way: Floats) -> tuple[str, str]:
    """Learn a bag; return ``right``, ``said``, ``refused`` or ``wrong``, and what was said."""
    workspace = Workspace(default_lattice(kind.side), is_fitted=True, any_frame=True,
                          any_lattice=True, speed_max=kind.speed_max)
    try:
        found = open_drive(path, workspace, ReadOptions())
        record, report, notes = demonstration_from_drive(found, speed_max=kind.speed_max)
    except BagError as error:
        return 'refused', str(error)
    said = '; '.join([*report.sentences(), *notes])
    cells, true = record.cells, found.grid.cells_from_world(_places(way))
    goal = found.grid.cells_from_world(way[-1:])[0]
    is_right = np.abs(cells[-1] - goal).max() <= 1 and _near(cells, true) and _near(true, cells)
    return ('said' if said else 'right') if is_right else 'wrong', said


def _places(way: Floats) -> Floats:
    """Return places along a way, no farther apart than its poses, but no closer than needed."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
    at = np.arange(0.0, along[-1] + _APART, _APART)
    return np.stack([np.interp(at, along, axis) for axis in way.T], axis=1)


def _near(some: npt.NDArray[Any], others: npt.NDArray[Any]) -> bool:
    """Return whether each of some cells lies on or beside one of others."""
    beside = {(row + i, col + j) for row, col in others.tolist()
              for i in (-1, 0, 1) for j in (-1, 0, 1)}
    return all((row, col) in beside for row, col in some.tolist())


def judged(name: str, seed: int) -> tuple[str, str]:
    """Write a drive of a kind, learn it, and return what became of it, and what was said."""
    kind = KINDS[name]
    with TemporaryDirectory() as folder:
        path = Path(folder) / ('drive.bag' if kind.storage == 'ros1' else 'drive')
        with BagWriter(path, kind.storage) as bag:
            way = kind.write(bag, np.random.default_rng(seed))
        return outcome(path, kind, way)


def is_as_it_must_be(name: str, result: tuple[str, str]) -> bool:
    """Return whether a kind was learnt right or refused, as it must be, and the words said."""
    kind, (what, said) = KINDS[name], result
    fits = what != 'wrong' and kind.is_refused in (None, what == 'refused')
    return fits and kind.says in said


def main() -> int:
    """Print the table; return 1 if anything is not as it must be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--drives', type=int, default=3, help='of each kind (%(default)s)')
    n, n_bad = parser.parse_args().drives, 0
    columns = ('right', 'said', 'refused', 'wrong')
    print(f'{"kind":26}' + ''.join(f'{column:>9}' for column in columns) + '  must be')
    for name, kind in KINDS.items():
        found = [judged(name, seed) for seed in range(n)]
        bad = [result for result in found if not is_as_it_must_be(name, result)]
        counts = [sum(what == column for what, _ in found) for column in columns]
        print(f'{name:26}' + ''.join(f'{count or "":>9}' for count in counts)
              + f'  {_MUST[kind.is_refused]}'
              + (f'  NOT SO: {bad[0][0]}, {bad[0][1][:300]}' if bad else ''), flush=True)
        n_bad += len(bad)
    return 1 if n_bad else 0


if __name__ == '__main__':
    sys.exit(main())
