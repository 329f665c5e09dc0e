"""What a bag of others holds: its topics, and where each of them says that something was."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.demonstration import DemonstrationReport
from control_field.records import Demonstration
from episode_store.external.drive import ExternalDrive, open_drive, ReadOptions
from episode_store.external.drive_poses import DrivePoses, poses_from_frames, poses_from_messages
from episode_store.external.import_drive import demonstration_from_drive
from episode_store.external.topic_roles import pose_topics
from episode_store.external.transforms import read_transforms, topics_of
from episode_store.external.workspace import Workspace
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import Bag
from msgs_bridge.messages.poses import MAX_PLACE
from msgs_bridge.sensing.frame_tree import TF_TYPE

Floats = npt.NDArray[np.float64]

#: The way is measured between places so far apart in time, [s]: what jitters goes nowhere.
_STRIDE: Final = 0.5
#: The greatest speed holds for so long, [s].
_LASTING: Final = 1.0


@dataclass(frozen=True, eq=False)
class PoseSource:
    """
    Where one topic says that something was.

    Parameters
    ----------
    topic, type_name : str
    frame_id, base : str
        In which frame, and of which one, as far as that is named.
    seconds : ndarray, shape (n,), [s]
        Increasing, from the first.
    places : ndarray, shape (n, 3), [m]
    problem : str
        Why it cannot be read.

    """

    topic: str
    type_name: str
    frame_id: str = ''
    base: str = ''
    seconds: Floats = field(default_factory=lambda: np.zeros(0))
    places: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    problem: str = ''

    @property
    def duration(self) -> float:
        """Return from when to when it speaks, [s]."""
        return float(self.seconds[-1]) if len(self.seconds) else 0.0

    @property
    def rate(self) -> float:
        """Return how often, [Hz]; 0 where no time passes."""
        return (len(self.seconds) - 1) / self.duration if self.duration > 0.0 else 0.0

    @cached_property
    def way(self) -> float:
        """Return how far it goes in x and y, [m]."""
        return float(np.hypot(*np.diff(self._every(_STRIDE)[1], axis=0).T).sum())

    @cached_property
    def speed(self) -> float:
        """Return the greatest speed in x and y for a second, [m/s]."""
        seconds, places = self._every(_LASTING)
        steps = np.hypot(*np.diff(places, axis=0).T)
        return float((steps / np.maximum(np.diff(seconds), 1e-9)).max(initial=0.0))

    def _every(self, stride: float) -> tuple[Floats, Floats]:
        """Return the times and places between which so many seconds lie, and the last."""
        if not len(self.seconds):
            return self.seconds, self.places[:, :2]
        at = np.arange(0.0, self.duration, stride)[:1_000_000]
        index = np.unique(np.append(np.searchsorted(self.seconds, at), len(self.seconds) - 1))
        return self.seconds[index], self.places[index, :2]


@dataclass(frozen=True, eq=False)
class Survey:
    """
    What a bag of others holds.

    Parameters
    ----------
    bag : Bag
    sources : list of PoseSource
    drive : ExternalDrive or None
        What would be learnt from.
    content : tuple of Demonstration and DemonstrationReport, or None
        What it would teach.
    notes : tuple of str
    refusal : str
        Why it would not be learnt; empty if it would.

    """

    bag: Bag
    sources: list[PoseSource]
    drive: ExternalDrive | None = None
    content: tuple[Demonstration, DemonstrationReport] | None = None
    notes: tuple[str, ...] = ()
    refusal: str = ''


def look_into(
    path: Path, workspace: Workspace, reading: ReadOptions, speed_max: float,
) -> Survey:
    """
    Look into a bag of others; scans and pictures are counted, not read.

    Parameters
    ----------
    path : Path
    workspace : Workspace
        That it would be learnt in.
    reading : ReadOptions
    speed_max : float, [m/s]
        A robot that drives faster is none.

    Raises
    ------
    BagError
        If it cannot be read at all.

    """
    bag = open_bag(path)
    sources = list(pose_sources(bag, reading))
    try:
        drive = open_drive(path, workspace, reading, bag, with_local_grid=False)
    except BagError as error:
        return Survey(bag, sources, refusal=_without_path(error, path))
    try:
        record, report, notes = demonstration_from_drive(drive, speed_max=speed_max)
    except BagError as error:
        return Survey(bag, sources, drive, refusal=_without_path(error, path))
    return Survey(bag, sources, drive, (record, report), notes)


def _without_path(error: BagError, path: Path) -> str:
    return str(error).removeprefix(f'{path}: ')


def pose_sources(bag: Bag, reading: ReadOptions) -> Iterator[PoseSource]:
    """Go through the topics that say where something was."""
    for topic in pose_topics(bag):
        kind = bag.topics[topic]
        try:
            poses = _poses_of(bag, topic, reading)
        except BagError as error:
            yield PoseSource(topic, kind, problem=str(error).removeprefix(f'{topic}: '))
            continue
        if poses is not None:
            yield _source(topic, kind, poses)


def _poses_of(bag: Bag, topic: str, reading: ReadOptions) -> DrivePoses | None:
    """Return what a topic says of where the robot was; None if that is not its matter."""
    if bag.topics[topic] != TF_TYPE:
        poses = poses_from_messages(bag.messages(topic))
        return poses if poses.has_stamps else poses.by_log_times()
    if topic.rpartition('/')[2] != 'tf':
        return None
    topics, _ = topics_of(bag, topic.rpartition('/')[0])
    tree = read_transforms(bag, topics, reading.span)
    return poses_from_frames(tree, reading.base_frame, '', topic)[0]


def _source(topic: str, kind: str, poses: DrivePoses) -> PoseSource:
    places = poses.motions.shift
    sound = np.flatnonzero((np.abs(places) <= MAX_PLACE).all(axis=1))
    if not len(sound):
        return PoseSource(topic, kind, poses.frame_id, poses.base, problem='no sound pose in it')
    order = sound[np.argsort(poses.stamps_ns[sound], kind='stable')]
    seconds = (poses.stamps_ns[order] - poses.stamps_ns[order[0]]) * 1e-9
    return PoseSource(topic, kind, poses.frame_id, poses.base, seconds, places[order])
