"""Where the robot was under way, in the frame of the workspace: from odometry, poses or `/tf`."""

from dataclasses import dataclass, replace
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.words import counted
from episode_store.drives import check_end, sets_off
from episode_store.external.span import Span
from episode_store.rosbag2.columns import read_columns
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.cdr_write import pose_stamped_to_cdr
from msgs_bridge.messages.poses import QUATERNION_TOLERANCE
from msgs_bridge.sensing.corrections import said_of
from msgs_bridge.sensing.frame_tree import Edge, Lost, Transforms
from msgs_bridge.sensing.rigid_motions import Motions

_PLACE: Final = ('x', 'y', 'z')
_TURN: Final = ('qx', 'qy', 'qz', 'qw')
#: A correction is kept for so long without a word, [s].
_SILENT: Final = 1.0
#: Poses are measured more rarely than they are sent if so many times, or more, they move by so
#: much, [m], so many times as rarely, but no more rarely than that, [s], evenly for this share.
_FEWEST, _LONG_STEP, _RARER, _RAREST, _EVEN = 6, 0.05, 3.0, 2.0, 0.7

Integers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class DrivePoses:
    """
    Where the robot's middle was in a frame.

    Parameters
    ----------
    frame_id, base : str
        The frame, and that of the robot's middle (empty where the messages do not name it).
    stamps_ns, log_times : ndarray of int64, shape (n,), [ns]
    motions : Motions
    begins_ns : int, [ns]
        First stamp of the whole drive, in whatever frame.
    lost : tuple of Lost
        What comes before the first and after the last and says nothing of where the robot was.
    has_headings : bool
        Whether they say where it looked; else along x.

    """

    frame_id: str
    base: str
    stamps_ns: Integers
    log_times: Integers
    motions: Motions
    begins_ns: int
    lost: tuple[Lost, ...] = ()
    has_headings: bool = True

    def check_ends(self, since: float = -np.inf, until: float = np.inf) -> None:
        """
        Refuse poses that begin after the drive does, or end before it.

        Parameters
        ----------
        since, until : float, [ns]
            Times of the recording between which the drive is meant.

        Raises
        ------
        BagError

        """
        inside = (self.log_times >= since) & (self.log_times <= until)
        seconds = (self.stamps_ns[inside] - self.begins_ns) * 1e-9
        if not len(seconds):
            return
        begun = sets_off(seconds, self.motions.shift[inside, :2])
        for lost in self.lost:
            times = lost.log_times[(lost.log_times >= since) & (lost.log_times <= until)]
            is_end = lost.next_to > self.log_times[inside].min()
            if not len(times) or not (is_end or begun):
                continue
            missing = float(np.abs(times - lost.next_to).max()) * 1e-9
            ends = ('ends', 'last') if times[0] > lost.next_to else ('begins', 'first')
            try:
                check_end(*ends, len(times), missing, lost.why)
            except ValueError as error:
                cut = (f'before that (--to {math.floor(seconds[-1] * 100.0 + 1e-4) / 100.0:.2f})'
                       if is_end else 'after that (--from '
                       f'{math.ceil(seconds[0] * 100.0 - 1e-4) / 100.0:.2f})')
                raise BagError(f'{error}, or keep what is {cut}') from None

    @property
    def seconds(self) -> npt.NDArray[np.float64]:
        """Return when they are of, from the beginning of the drive, [s]."""
        return np.asarray((self.stamps_ns - self.begins_ns) * 1e-9)

    @property
    def has_stamps(self) -> bool:
        """Return whether stamps tell when they are of, where there are several."""
        return len(self.stamps_ns) < 2 or bool(np.ptp(self.stamps_ns)) or not np.ptp(
            self.log_times)

    def by_log_times(self) -> 'DrivePoses':
        """Return them stamped with the times they were recorded at."""
        return replace(self, stamps_ns=self.log_times, begins_ns=int(self.log_times.min()))

    def measured(self) -> tuple['DrivePoses', float]:
        """
        Leave out poses that only repeat the last one that was measured.

        Returns
        -------
        poses : DrivePoses
        period : float, [s]
            How often they were measured; 0 where that is as often as they were sent.

        """
        order = np.argsort(self.stamps_ns, kind='stable')
        seconds, places = self.seconds[order], self.motions.shift[order, :2]
        steps = np.hypot(*np.diff(places, axis=0).T)
        changes = np.flatnonzero(steps > 0.0) + 1
        if len(changes) < _FEWEST or np.median(steps[changes - 1]) < _LONG_STEP:
            return self, 0.0
        between, sent = np.diff(seconds[changes]), float(np.median(np.diff(seconds)))
        period = float(np.median(between))
        is_even = np.abs(between - period) < 0.5 * period
        if not _RARER * sent < period <= _RAREST or is_even.mean() < _EVEN:
            return self, 0.0
        kept, last = [0], 0
        moved = np.append(True, steps > 0.0)
        for i in range(1, len(seconds)):
            if moved[i] or seconds[i] - seconds[last] >= period:
                kept.append(last := i)
        rows = order[kept]
        return replace(self, stamps_ns=self.stamps_ns[rows], log_times=self.log_times[rows],
                       motions=self.motions.at(rows)), period

    def messages(self, topic: str) -> RawMessages:
        """Return them as PoseStamped messages."""
        rows = zip(self.stamps_ns.tolist(), self.motions.shift.tolist(),
                   self.motions.yaw.tolist(), strict=True)
        return RawMessages.of(topic, 'geometry_msgs/msg/PoseStamped', [
            pose_stamped_to_cdr(stamp, self.frame_id, x, y, yaw) for stamp, (x, y, _), yaw in rows
        ], self.log_times.tolist())


def poses_from_messages(messages: RawMessages, span: Span | None = None) -> DrivePoses:
    """
    Read odometry or poses; only those in the frame of the first, and what is a place at all.

    Parameters
    ----------
    messages : RawMessages
    span : Span, optional
        The first of this part of the drive counts.

    Raises
    ------
    CdrError
        If the messages are of another type.

    """
    is_odometry = messages.type_name == 'nav_msgs/msg/Odometry'
    columns = read_columns(messages, dict.fromkeys(('sec', 'nanosec', *_PLACE, *_TURN), 1))
    frames = [frame.lstrip('/') for frame in columns.texts('frame_id')]
    bases = [base.lstrip('/') for base in columns.texts('child_frame_id')] if is_odometry else []
    values = columns.values
    shift = np.stack([values[name] for name in _PLACE], axis=1)
    turn = np.stack([values[name] for name in _TURN], axis=1)
    with np.errstate(invalid='ignore', over='ignore'):
        # Who knows no heading often leaves the quaternion as it is, of zeros.
        has_headings = bool(turn.any()) or not columns.accepted.any()
        turn[:, 3] += not has_headings
        length = np.linalg.norm(turn, axis=1)
        sound = columns.accepted & np.isfinite(shift).all(axis=1) & (values['sec'] >= 0)
        sound &= np.abs(length - 1.0) <= QUATERNION_TOLERANCE
    stamps = values['sec'].astype(np.int64) * 1_000_000_000 + values['nanosec'].astype(np.int64)
    begins = int(stamps[sound].min()) if sound.any() else 0
    asked = np.flatnonzero(sound & (span or Span()).holds(stamps, begins))
    # Where none is sound, the frame is what the first message says.
    first = int(columns.layout[asked[0]]) if len(asked) else 0
    frame = frames[first] if frames else ''
    sound &= np.isin(columns.layout, [i for i, name in enumerate(frames) if name == frame])
    times = messages.log_times
    first_time, last = (int(end(times[sound])) if sound.any() else 0 for end in (np.min, np.max))
    why = f'{messages.topic}: no sound pose in {frame!r}, the frame of the first'
    lost = (Lost(why, first_time, times[times < first_time]), Lost(why, last, times[times > last]))
    return DrivePoses(
        frame, bases[first] if bases else '', stamps[sound], times[sound],
        Motions(shift[sound], turn[sound] / length[sound, np.newaxis]), begins, lost,
        has_headings)


def poses_from_frames(
    tree: Transforms, base: str, frame_id: str, topic: str,
) -> tuple[DrivePoses, list[str]]:
    """
    Return where a frame was in one above it, whenever the joint that moves next to it was said.

    Parameters
    ----------
    tree : Transforms
    base : str
        The robot's middle; the one that is called so if it is empty.
    frame_id : str
        The workspace's frame; empty: that of odometry.
    topic : str
        What an error calls it all.

    Raises
    ------
    BagError
        If there is no such chain, or nothing moves in it.

    """
    base, chain = _chain(tree, base, frame_id, topic)
    frame_id = chain[0].parent
    # The wheels' own joint: what is missing of it is not to be made of one that is said oftener.
    moving = [edge for edge in chain if len(edge.stamps_ns) > 1 and not edge.is_fixed]
    driven = moving[-1] if moving else max(chain, key=lambda edge: len(edge.stamps_ns))
    if len(driven.stamps_ns) < 2:
        raise BagError(f'{topic}: all that says where {base} is in {frame_id} bears one stamp')
    before = chain[:chain.index(driven)]
    after = chain[chain.index(driven) + 1:]
    poses = DrivePoses(frame_id, base, driven.stamps_ns, driven.log_times, driven.motions,
                       driven.begins_ns, _lost([driven, *after], topic))
    for edge in after:
        poses = replace(poses, motions=poses.motions.then(edge.at(poses.stamps_ns)))
    poses, notes = _brought(poses, before, frame_id, topic)
    names = ' -> '.join([frame_id, *(edge.child for edge in chain)])
    return poses, [f'poses are those of {base} in {frame_id}, from {topic} ({names})', *notes]


def brought_to_frame(
    poses: DrivePoses, tree: Transforms, frame_id: str, topic: str,
) -> tuple[DrivePoses, list[str]] | None:
    """Take poses to a frame above theirs; None if there is no way to it."""
    chain = tree.chain(poses.frame_id, frame_id)
    if not chain:
        return None
    found, notes = _brought(poses, chain, frame_id, topic)
    return found, [f'poses are taken from {poses.frame_id} to {frame_id} by {topic}', *notes]


def _brought(
    poses: DrivePoses, chain: list[Edge], frame_id: str, topic: str,
) -> tuple[DrivePoses, list[str]]:
    """Put the edges above a frame before its poses; drop those before anything was said."""
    notes: list[str] = []
    moving = [edge for edge in chain if len(edge.stamps_ns) > 1]
    known = np.ones(len(poses.stamps_ns), dtype=np.bool_)
    for edge in moving:
        known &= poses.stamps_ns >= edge.stamps_ns[0]
    if not known.any():
        raise BagError(f'{topic}: nothing says where {poses.frame_id} is in {frame_id} at the '
                       f'time of the poses')
    if n_early := int((~known).sum()):
        notes.append(f'{counted(n_early, "pose")} before {topic} says anything of {frame_id} '
                     f'dropped')
    stamps = poses.stamps_ns[known]
    for edge in moving:
        silent = float(stamps.max() - edge.stamps_ns[-1]) * 1e-9
        if silent > _SILENT:
            notes.append(f'in the last {silent:.1f} s nothing new is said of {edge.child} in '
                         f'{edge.parent}: what was said last is kept')
    motions = poses.motions.at(known.nonzero()[0])
    for edge in reversed(chain):
        motions, corrections = edge.carrying(stamps, motions)
        notes += said_of(corrections, f'{edge.child} in {edge.parent} ({topic})',
                         float(stamps[0] - edge.stamps_ns[0]) * 1e-9)
    return replace(poses, frame_id=frame_id, stamps_ns=stamps, log_times=poses.log_times[known],
                   motions=motions, lost=(*poses.lost, *_lost(chain, topic))), notes


def _lost(chain: list[Edge], topic: str) -> tuple[Lost, ...]:
    """Return what is said of frames that in the end are under another one than before."""
    return tuple(lost._replace(why=f'{topic}: {lost.why}')
                 for edge in chain for lost in edge.lost)


def _chain(
    tree: Transforms, base: str, frame_id: str, topic: str,
) -> tuple[str, list[Edge]]:
    """Return the robot's middle and the edges above it."""
    bases = [base.lstrip('/')] if base else tree.bases()
    if not bases:
        raise BagError(f'{topic}: no frame is called base_link or base_footprint, there are '
                       f'{_names(sorted(tree.edges))}: name that of the robot with --base-frame')
    for each in bases:
        if chain := tree.chain(each, frame_id.lstrip('/') or _odometry_frame(tree, each)):
            return each, chain
    above = [frame for frame in tree.above(bases[0])[1:] if frame not in bases]
    if not above:
        raise BagError(f'{topic}: nothing says where {bases[0]} is, there are '
                       f'{_names(sorted(tree.edges))}')
    raise BagError(f'{topic}: {bases[0]} is not under {frame_id!r} but under {_names(above)}: '
                   f'learn it with --frame {above[-1]}')


def _odometry_frame(tree: Transforms, base: str) -> str:
    """Return the frame above the robot that is called odom, else what its own joint hangs on."""
    above = tree.above(base)[1:]
    called = [frame for frame in above if frame.rpartition('/')[2] == 'odom']
    moving = [frame for frame, below in zip(above, tree.above(base), strict=False)
              if not tree.edges[below].is_fixed]
    return next(iter([*called, *moving, *above[-1:]]), '')


def _names(frames: list[str]) -> str:
    return ', '.join(frames[:8]) or 'none'
