"""
A drive that another recorder recorded, made ready to be learnt from.

What is missing of it and follows from what was recorded is made here, once: poses in the frame of
the workspace from `/tf`, the 3x3 local grid from laser scans. It goes into the bag of ours as
messages like any others, so that the field stays a function of that bag.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from control_field.grid import Grid
from control_field.words import counted
from episode_store.external.drive_poses import (
    brought_to_frame, DrivePoses, poses_from_frames, poses_from_messages)
from episode_store.external.kinds_of_motion import doubts_about_motion
from episode_store.external.local_grids import described, local_grids_from_scans, read_scans
from episode_store.external.span import cut, Span
from episode_store.external.topic_roles import (
    is_meant, pose_topics, roles_of_topics, scans_in, WhichOdometryError)
from episode_store.external.transforms import read_transforms, topics_of
from episode_store.external.which_odometry import repeated_by_frames
from episode_store.external.workspace import Workspace
from episode_store.rosbag2.any_reader import notes_on, open_bag
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import Bag, RawMessages
from msgs_bridge.sensing.frame_tree import BASES, TF_TYPE, Transforms
from msgs_bridge.sensing.laser_mount import Mount, mount_from_transform
from msgs_bridge.sensing.local_grid_from_scan import Body

#: What moves no farther stands still, [m].
_STILL: Final = 0.01


@dataclass(frozen=True)
class ReadOptions:
    """
    How a bag of others is to be read.

    Parameters
    ----------
    names : mapping of str to str
        Topics by role, see `topic_roles.ROLES`.
    base_frame : str
        The frame of the robot's middle; empty: the one that is called so.
    mount : Mount or None
        Where the laser sits; None: as `/tf_static` says.
    body : Body
        The robot's size, and how far its scans are trusted.
    zero_is_no_return : bool
        Whether the laser's driver writes 0 where nothing is in range.
    span : Span
        Which part of the drive is read.

    """

    names: Mapping[str, str] = field(default_factory=dict)
    base_frame: str = ''
    mount: Mount | None = None
    body: Body = field(default_factory=lambda: Body(0.105))
    zero_is_no_return: bool = False
    span: Span = field(default_factory=Span)


@dataclass(frozen=True, eq=False)
class ExternalDrive:
    """
    A drive that another recorder recorded.

    Parameters
    ----------
    path : Path
        As it was named.
    grid : Grid
        The workspace it is read for.
    is_fitted : bool
        Whether that was made to fit it.
    bag : DriveBag
        With what was made of it.
    topics : dict of str to str
        Topics of ``bag`` by role, without those that only something was made from.
    notes : tuple of str
        What it was made from, and what of the bag was not read.
    read_from : str
        The topic that poses come from.
    recorded : dict of str to int
        The topics that were recorded, and how many messages.
    begins : float, [s]
        Where in the recording the part that is read begins.

    """

    path: Path
    grid: Grid
    is_fitted: bool
    bag: 'DriveBag'
    topics: dict[str, str]
    notes: tuple[str, ...]
    read_from: str
    recorded: dict[str, int]
    begins: float = 0.0


class DriveBag(Bag):
    """
    A bag of others as a drive is learnt from it: in the order of log times, and completed.

    Parameters
    ----------
    bag : Bag
    made : mapping of str to RawMessages
        By topic; they stand for those of the same name.

    """

    def __init__(self, bag: Bag, made: Mapping[str, RawMessages]) -> None:
        self.path, self._bag, self._made = bag.path, bag, made
        self.topics = {**bag.topics, **{
            topic: messages.type_name for topic, messages in made.items()}}
        self.counts = {**bag.counts, **{topic: len(messages) for topic, messages in made.items()}}

    def messages(self, topic: str) -> RawMessages:
        """Return the messages of a topic; none if it is not in the bag."""
        made = self._made.get(topic)
        found = self._bag.messages(topic) if made is None else made
        order = np.argsort(found.log_times, kind='stable')
        return replace(found, starts=found.starts[order], sizes=found.sizes[order],
                       log_times=found.log_times[order])


def open_drive(
    path: Path | str, workspace: Workspace | Grid, reading: ReadOptions | None = None,
    bag: Bag | None = None, with_local_grid: bool = True,
) -> ExternalDrive:
    """
    Open a bag of others for a workspace.

    Parameters
    ----------
    path : Path
        See `any_reader.open_bag`.
    workspace : Workspace or Grid
        Poses are taken to its frame where `/tf` says how.
    reading : ReadOptions, optional
    bag : Bag, optional
        The one that is opened already.
    with_local_grid : bool
        Whether local grids are made from all scans, which takes most of the time, or only from
        the first one, to say whether they could be.

    Raises
    ------
    BagError
        If it cannot be read, a named topic is not in it, nothing says where the robot was, or no
        workspace is large enough.

    """
    if isinstance(workspace, Grid):
        workspace = Workspace(workspace)
    bag, reading = bag or open_bag(path), reading or ReadOptions()
    try:
        reader = _DriveReader(bag, workspace, reading)
        poses = reader.read_poses()
        times = reader.span_of(poses)
        reader.settle(poses, times)
    except BagError as error:
        raise BagError('; '.join([f'{path}: {error}', *notes_on(bag)])) from None
    reader.make_local_grid(poses, with_local_grid)
    made, topics = reader.made, {
        role: topic for role, topic in reader.topics.items() if role != 'scan'}
    if times is not None:
        made = cut(map(DriveBag(bag, made).messages, set(topics.values())), *times)
        reader.notes.append(str(reading.span))
    return ExternalDrive(
        Path(path), reader.grid, workspace.is_fitted, DriveBag(bag, made), topics,
        (*reader.notes, *notes_on(bag)), reader.read_from, bag.counts,
        max(reading.span.first, 0.0))


def _left_out(messages: RawMessages, found: DrivePoses) -> list[str]:
    """Say how many messages are no poses in the frame of the first."""
    n = len(messages) - len(found.stamps_ns)
    return [f'{counted(n, "message")} refused: {found.lost[0].why}'] if n else []


def _stands(poses: DrivePoses) -> bool:
    """Return whether poses never move."""
    places = poses.motions.shift[np.isfinite(poses.motions.shift).all(axis=1), :2]
    return not len(places) or bool(np.ptp(places, axis=0).max() < _STILL)


class _DriveReader:
    """Reads where the robot was from the topics of a bag, and makes what is missing of them."""

    def __init__(self, bag: Bag, workspace: Workspace, reading: ReadOptions) -> None:
        self.bag, self.workspace, self.reading = bag, workspace, reading
        self.grid = workspace.grid
        self.notes: list[str] = []
        self.made: dict[str, RawMessages] = {}
        self.topics = self._roles()
        self.read_from = self.topics['odom']
        self._is_stamped = True
        self._tf, self._no_frames = topics_of(bag, self.read_from.rpartition('/')[0])

    def _roles(self) -> dict[str, str]:
        """Return which topic plays which role; of several the one that `/tf` repeats is odom."""
        try:
            return roles_of_topics(self.bag, self.reading.names)
        except WhichOdometryError as error:
            topic = repeated_by_frames(self.bag, error.topics)
            if topic is None:
                raise
        self.notes.append(f'odom is {topic}, the only one that /tf repeats')
        return roles_of_topics(self.bag, {**self.reading.names, 'odom': topic})

    @cached_property
    def tree(self) -> Transforms:
        """Return what is said of frames; read when it is asked for, there may be much of it."""
        return read_transforms(self.bag, self._tf, self.reading.span)

    def read_poses(self) -> DrivePoses:
        """Read the poses; where they are made from others, they become `odom`."""
        try:
            found, notes = self._poses()
        except BagError:
            if 'odom' in self.reading.names or self.bag.topics[self.topics['odom']] != TF_TYPE:
                raise
            # Perhaps there are poses of another kind.
            try:
                self.topics = roles_of_topics(self.bag, self.reading.names, with_frames=False)
            except BagError:
                pass
            else:
                return self.read_poses()
            raise
        found, period = found.measured()
        if period:
            notes.append(f'the poses on {self.topics["odom"]} are new every {period:.2g} s and '
                         f'repeated in between: each counts once')
        if (other := self._other_than_standing(found)) is not None:
            self.notes.append(f'{self.topics["odom"]} stands still: where the robot was is read '
                              f'from {other}')
            self.topics['odom'] = other
            return self.read_poses()
        self.read_from = self.topics['odom']
        if notes:
            self.notes += notes
            self.topics['odom'] = self._free_name('odom')
            self.made[self.topics['odom']] = found.messages(self.topics['odom'])
        return found

    def _other_than_standing(self, found: DrivePoses) -> str | None:
        """
        Return the topic of poses that moves, for one that was not named and does not.

        Raises
        ------
        BagError
            If several do.

        """
        if 'odom' in self.reading.names or not _stands(found):
            return None
        others = [topic for topic in pose_topics(self.bag) if topic != self.topics['odom']
                  and self.bag.topics[topic] != TF_TYPE and is_meant(self.bag, topic)
                  and not _stands(poses_from_messages(self.bag.messages(topic)))]
        if len(others) > 1:
            raise BagError(f'{self.topics["odom"]} stands still; name one of {", ".join(others)} '
                           f'with --odom-topic')
        return next(iter(others), None)

    def settle(self, poses: DrivePoses, times: tuple[int, int] | None) -> None:
        """Let the workspace be that of the drive, as far as it is free to."""
        self.grid = self.workspace.framed(poses.frame_id)
        if poses.frame_id == self.grid.frame_id.lstrip('/'):
            first, last = times or (-np.inf, np.inf)
            read = np.flatnonzero((poses.log_times >= first) & (poses.log_times <= last))
            self.notes += doubts_about_motion(
                poses.seconds[read], poses.motions.at(read), poses.frame_id)
        if self.workspace.is_fitted:
            topic = self.topics['odom']
            messages = self.made.get(topic) or self.bag.messages(topic)
            if times is not None:
                messages = cut([messages], *times)[topic]
            seen = self.topics.get('neighbourhood')
            self.grid = self.workspace.fitted(
                messages, None if seen is None else self.bag.messages(seen), self.grid.frame_id)

    def span_of(self, poses: DrivePoses) -> tuple[int, int] | None:
        """Return which part of the recording is read, [ns]; None for all of it."""
        span = self.reading.span
        if span.is_whole:
            # In another frame all of them are refused, which is said where they are read.
            if self.made or poses.frame_id == self.workspace.frame_of(poses.frame_id):
                poses.check_ends()
            return None
        first, last, *around = span.log_times(poses.stamps_ns, poses.log_times, poses.begins_ns)
        poses.check_ends(*around)
        return first, last

    def _poses(self) -> tuple[DrivePoses, list[str]]:
        topic, frame_id = self.topics['odom'], self.workspace.frame_id
        if self.bag.topics[topic] == TF_TYPE:
            if not self._tf:
                raise BagError(f'{self._no_frames}, name one with --odom-topic')
            found, notes = poses_from_frames(
                self.tree, self.reading.base_frame, frame_id, topic)
            if n := self.tree.n_refused:
                notes.append(f'{counted(n, "transform")} of {topic} refused: not finite, or no '
                             f'rotation')
            return found, notes
        messages = self.bag.messages(topic)
        found, notes = poses_from_messages(messages, self.reading.span), list[str]()
        if not found.has_stamps:
            self._is_stamped = False
            found = poses_from_messages(messages).by_log_times()
            notes.append(f'no message on {topic} bears a stamp of its own: the times at which '
                         f'they were recorded count')
        if not found.has_headings:
            notes.append(f'no message on {topic} says where the robot looks (quaternions of '
                         f'zeros): only places are learnt')
        if found.frame_id != self.workspace.frame_of(found.frame_id) and self._tf:
            brought = brought_to_frame(found, self.tree, frame_id.lstrip('/'), self._tf[0])
            if brought is not None:
                return brought[0], [*notes, *brought[1], *_left_out(messages, found)]
        return found, notes

    def make_local_grid(self, poses: DrivePoses, from_all: bool = True) -> None:
        """Make the local grid from laser scans if there are any; note why not."""
        topic = self.topics.get('scan')
        if 'neighbourhood' in self.topics and 'scan' not in self.reading.names:
            return  # one that was recorded goes before
        if topic is None:
            if lasers := scans_in(self.bag):
                self.notes.append(f'no local grid: it may be made from {" or ".join(lasers)}, '
                                  f'name one with --scan-topic')
            return
        messages = self.bag.messages(topic)
        scans = read_scans(messages if from_all else messages.first(), (
            self.reading.zero_is_no_return), self._is_stamped)
        if not scans.scans:
            self.notes.append(f'no local grid: no scan on {topic} makes sense, {scans.refusal}')
            return
        mount = self._mount(scans.frame_id, poses)
        problem = mount.problem if mount else (
            f'nothing says where {scans.frame_id!r} sits on the robot, say so with --laser X Y Z '
            'ROLL PITCH YAW')
        if mount is None or problem:
            self.notes.append(f'no local grid from {topic}: {problem}')
            return
        if not len(poses.stamps_ns) or poses.frame_id != self.grid.frame_id.lstrip('/'):
            return
        if not from_all:
            self.notes.append(f'local grids can be made from {counted(len(messages), "scan")} on '
                              f'{topic}')
            return
        name = self._free_name('neighbourhood')
        self.made[name] = local_grids_from_scans(
            scans, poses, mount, self.grid, self.reading.body, name)
        self.topics['neighbourhood'] = name
        self.notes.append(described(scans, mount, self._base(poses)))

    def _base(self, poses: DrivePoses) -> str:
        return self.reading.base_frame.lstrip('/') or poses.base

    def _mount(self, laser: str, poses: DrivePoses) -> Mount | None:
        """Return where the laser sits on the robot, and how high above the floor."""
        if self.reading.mount is not None:
            return self.reading.mount
        base = self._base(poses)
        bases = [base, *(each for each in self.tree.bases() if each != base)]
        for each in filter(None, bases):
            if each == laser:
                return Mount()
            found = self.tree.fixed(laser, each)
            if found is not None:
                return mount_from_transform(found.matrix())._replace(z=self._height(laser))
        return None

    def _height(self, laser: str) -> float:
        """Return the laser's height above the floor, where base_footprint is; 0 if not known."""
        floor = [each for each in self.tree.bases() if each.rpartition('/')[2] == BASES[0]]
        found = self.tree.fixed(laser, floor[0]) if floor else None
        return 0.0 if found is None else max(float(np.round(found.shift[0, 2], 6)), 0.0)

    def _free_name(self, role: str) -> str:
        """Return a name that no topic has that is kept for another role."""
        taken = {topic for other, topic in self.topics.items() if other != role}
        name = f'/{role}'
        while name in taken:
            name += '_made'
        return name
