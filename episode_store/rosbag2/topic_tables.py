"""What the learner needs of a bag, as tables: poses, local grids, decisions, how it ended."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.drives.dead_reckoning import Motion
from control_field.drives.workspace import FAR_AWAY
from control_field.grid import Grid
from control_field.headings import N_HEADINGS, STEP_COL, STEP_ROW
from control_field.local_grid import BLOCKED, UNKNOWN
from control_field.records import DECISION_DTYPE
from episode_store.rosbag2.columns import Columns, Group, groups, read_columns
from episode_store.rosbag2.local_grid_cells import read_cells
from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.cdr import (
    CdrError, DESCRIBED, DIAGNOSTIC_STATUS, POINT_CLOUD, struct_from_cdr)
from msgs_bridge.messages.clouds import TableError
from msgs_bridge.messages.neighbourhoods import ALIGNMENT_TOLERANCE, MAX_TURN
from msgs_bridge.messages.poses import MAX_PLACE, QUATERNION_TOLERANCE
from msgs_bridge.messages.tables import decisions_by_place, decisions_from_cloud
from msgs_bridge.messages.trial_status import trial_from_status, TrialStatus

_STAMP: Final = {'sec': 1, 'nanosec': 1}
_POSE: Final = dict.fromkeys(('x', 'y', 'qx', 'qy', 'qz', 'qw'), 1)


@dataclass(frozen=True, eq=False)
class PoseTable:
    """
    The poses of a drive, in the order of recording.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
    xy : ndarray, shape (n, 2), [m]
    n_refused : int
        Messages that were left out.
    refusal : str
        Why the first of them was.
    before, after : tuple of int and float
        How many messages before the first and after the last pose were left out, and for how
        long, [s].
    motion : Motion or None
        Headings and speeds, as far as the messages give them.
    other_frame : str
        The frame of the first that was left out, if that is why.

    """

    stamps: npt.NDArray[np.float64]
    xy: npt.NDArray[np.float64]
    n_refused: int
    refusal: str
    before: tuple[int, float] = (0, 0.0)
    after: tuple[int, float] = (0, 0.0)
    motion: Motion | None = None
    other_frame: str = ''


@dataclass(frozen=True, eq=False)
class LocalGridTable:
    """
    The local grids of a drive, in the order of recording.

    Parameters
    ----------
    stamps : ndarray, shape (n,), [s]
    cells : ndarray of int64, shape (n, 2)
        The robot's ``(row, col)``.
    blocked, unknown : ndarray of uint8, shape (n,)
        Masks of the cells around it.
    n_refused : int
        Messages that were left out.
    refusal : str
        Why the first of them was.
    local_grids : ndarray of `local_grid_dtype`, shape (m,)
        Those that show more than that, without repetitions.

    """

    stamps: npt.NDArray[np.float64]
    cells: npt.NDArray[np.int64]
    blocked: npt.NDArray[np.uint8]
    unknown: npt.NDArray[np.uint8]
    n_refused: int
    refusal: str
    local_grids: npt.NDArray[np.void]


def pose_table(messages: RawMessages, frame_id: str) -> PoseTable:
    """
    Read Odometry, PoseStamped or PoseWithCovarianceStamped messages.

    Messages that `poses.pose_from_odometry` would refuse, or in another frame, are left out and
    counted.

    Raises
    ------
    CdrError
        If the messages are of another type.

    """
    names = _STAMP | _POSE
    is_odometry = messages.type_name == 'nav_msgs/msg/Odometry'
    if is_odometry:
        names = names | {'vx': 1, 'vy': 1, 'wz': 1}
    columns = _checked(messages, names, frame_id)
    values = columns.values
    finite = (np.abs(values['x']) <= MAX_PLACE) & (np.abs(values['y']) <= MAX_PLACE)
    if is_odometry:
        finite &= np.isfinite(values['vx']) & np.isfinite(values['wz'])
    _refuse(columns, ~finite, f'{messages.topic}: position or velocity is not finite')
    _refuse(columns, ~_is_rotation(values), f'{messages.topic}: orientation is no rotation')
    kept = columns.accepted
    return PoseTable(_seconds(values)[kept], np.stack([values['x'], values['y']], axis=1)[kept],
                     int((~kept).sum()), columns.refusal, *_at_the_ends(messages, kept),
                     _motion(values, is_odometry).at(kept), columns.other_frame)


def _motion(values: dict[str, npt.NDArray[Any]], is_odometry: bool) -> Motion:
    """Return headings and speeds; a velocity that is not finite counts as 0."""
    if not is_odometry:
        return Motion(_yaw(values))
    velocity = np.stack([values['vx'], values['vy']], axis=1)
    return Motion(_yaw(values), np.where(np.isfinite(velocity), velocity, 0.0))


def _at_the_ends(
    messages: RawMessages, kept: npt.NDArray[np.bool_],
) -> tuple[tuple[int, float], tuple[int, float]]:
    """Return how many messages at either end are not kept, and how long they last, [s]."""
    left = np.flatnonzero(kept)
    if not len(left):
        return (0, 0.0), (0, 0.0)
    first, last, times = int(left[0]), int(left[-1]), messages.log_times
    return ((first, float(times[first] - times[0]) * 1e-9),
            (len(kept) - 1 - last, float(times[-1] - times[last]) * 1e-9))


def local_grid_table(
    messages: RawMessages, grid: Grid, fitted: bool = False,
) -> LocalGridTable:
    """
    Read OccupancyGrid messages of local grids on the cells of ``grid``, or on finer ones.

    Messages that `neighbourhoods.neighbourhood_from_grid` would refuse are left out and counted;
    in a workspace that fits itself those of cells outside ``grid`` are kept.

    Raises
    ------
    CdrError
        If the messages are of another type.

    """
    columns = _checked(messages, _STAMP | _POSE | {
        'resolution': 1, 'width': 1, 'height': 1}, grid.frame_id)
    values = columns.values
    read = read_cells(messages, columns, grid)
    _refuse(columns, ~_is_rotation(values) | ~(np.abs(_yaw(values)) <= MAX_TURN),
            f'{messages.topic}: origin is turned')
    cells = _cells(columns, grid, messages.topic, read.reach, fitted)
    stamps = _seconds(values)
    kept = columns.accepted
    return LocalGridTable(
        stamps[kept], cells[kept], _mask(read.nine, BLOCKED)[kept],
        _mask(read.nine, UNKNOWN)[kept], int((~kept).sum()), columns.refusal,
        read.local_grids(stamps, cells, kept))


def decision_table(
    messages: RawMessages, grid: Grid, fitted: bool = False,
) -> tuple[npt.NDArray[np.void], int, str]:
    """
    Read the decisions of `experience` messages, in the order they were recorded.

    In a workspace that fits itself their cells are those of ``grid`` whatever its extent was when
    they were made, and may lie outside it.

    Returns
    -------
    decisions : ndarray of DECISION_DTYPE, shape (n,)
    n_refused : int
        Messages that were left out because `tables.decisions_from_cloud` refuses them.
    refusal : str
        Why the first of them was.

    Raises
    ------
    CdrError
        If the messages are of another type.

    """
    _check_type(messages, 'sensor_msgs/msg/PointCloud2')
    columns = Columns({}, np.full(len(messages), -1, dtype=np.int32))
    parts: list[npt.NDArray[np.void]] = [np.zeros(0, dtype=DECISION_DTYPE)]
    order: list[npt.NDArray[np.int64]] = [np.zeros(0, dtype=np.int64)]
    read = partial(decisions_by_place if fitted else decisions_from_cloud, grid=grid)
    for group in groups(messages, POINT_CLOUD, columns, ()):
        for rows, decisions in _group_decisions(messages, group, read, columns):
            parts.append(decisions.reshape(-1))
            order.append(np.repeat(rows, decisions.shape[1]))
    decisions = np.concatenate(parts)[np.argsort(np.concatenate(order), kind='stable')]
    return decisions, int((~columns.accepted).sum()), columns.refusal


def _group_decisions(
    messages: RawMessages, group: Group, read: Callable[[Any], npt.NDArray[np.void]],
    columns: Columns,
) -> list[tuple[npt.NDArray[np.int64], npt.NDArray[np.void]]]:
    """Read messages of one layout at once; if that is refused, one by one."""
    try:
        return [(group.rows, _decisions(messages, group, group.rows, read))]
    except TableError as error:
        if len(group.rows) == 1:
            columns.refuse(group.rows, str(error))
            return []
    found = []
    for row in group.rows:
        alone = Group(group.layout, np.array([row]), group.heads[:0])
        found += _group_decisions(messages, alone, read, columns)
    return found


def _decisions(
    messages: RawMessages, group: Group, rows: npt.NDArray[np.int64],
    read: Callable[[Any], npt.NDArray[np.void]],
) -> npt.NDArray[np.void]:
    """Return the decisions of messages of one layout, shape (len(rows), decisions a message)."""
    values, place = group.layout.values, group.layout.places['data']
    data = messages.bytes_at(rows, place.offset, place.n)
    msg = SimpleNamespace(
        header=SimpleNamespace(frame_id=values['frame_id']), height=len(rows) * values['height'],
        width=values['width'], fields=[SimpleNamespace(**each) for each in values['fields']],
        is_bigendian=values['is_bigendian'], point_step=values['point_step'],
        row_step=values['row_step'], data=data)
    if values['height'] * values['row_step'] != place.n:
        raise TableError(f'experience: {place.n} bytes of data, must be {values["height"]} rows '
                         f'of {values["row_step"]}')
    msg.data = data.reshape(-1)
    return read(msg).reshape(len(rows), -1)


def statuses(
    messages: RawMessages, newest_first: bool = False,
) -> Iterator[tuple[int, TrialStatus]]:
    """
    Yield the `trial` messages with their places; messages that are no such status are skipped.

    Raises
    ------
    CdrError
        If the messages are of another type.

    """
    _check_type(messages, 'diagnostic_msgs/msg/DiagnosticStatus')
    order = range(len(messages))
    for i in reversed(order) if newest_first else order:
        try:
            values = struct_from_cdr(DIAGNOSTIC_STATUS, messages[i])
            values['values'] = [SimpleNamespace(**pair) for pair in values['values']]
            yield i, trial_from_status(SimpleNamespace(**values))
        except ValueError:
            continue


def _check_type(messages: RawMessages, type_name: str) -> None:
    if len(messages) and messages.type_name != type_name:
        raise CdrError(f'{messages.topic} is {messages.type_name}, must be {type_name}')


def _checked(messages: RawMessages, names: dict[str, int], frame_id: str) -> Columns:
    """Read columns of stamped messages; refuse other frames and invalid stamps."""
    fields = dict(DESCRIBED.get(messages.type_name, ()))
    missing = [name for name in names if name not in fields]
    if missing and len(messages):
        raise CdrError(f'{messages.topic} is {messages.type_name or "not there"}, '
                       f'which has no {missing[0]}')
    if not len(messages):
        empty: dict[str, Any] = {name: np.zeros((0, n) if n > 1 else 0)
                                 for name, n in names.items()}
        return Columns(empty, np.zeros(0, dtype=np.int32))
    columns = read_columns(messages, names)
    for number, frame in enumerate(columns.texts('frame_id')):
        if frame.lstrip('/') != frame_id.lstrip('/'):
            columns.other_frame = columns.other_frame or ('' if columns.refusal else frame[:80])
            _refuse(columns, columns.layout == number,
                    f'{messages.topic}: frame is {frame[:80]!r}, must be {frame_id!r}')
    values = columns.values
    _refuse(columns, (values['sec'] < 0) | (values['nanosec'] >= 1_000_000_000),
            f'{messages.topic}: it has no valid stamp')
    return columns


def _refuse(columns: Columns, bad: npt.NDArray[np.bool_], reason: str) -> None:
    columns.refuse(np.flatnonzero(bad & columns.accepted), reason)


def _seconds(values: dict[str, npt.NDArray[Any]]) -> npt.NDArray[np.float64]:
    """Return the same floats as `poses.seconds_from_stamp`."""
    return np.asarray(values['sec'] + values['nanosec'] * 1e-9, dtype=np.float64)


def _is_rotation(values: dict[str, npt.NDArray[Any]]) -> npt.NDArray[np.bool_]:
    with np.errstate(over='ignore', invalid='ignore'):
        length = np.sqrt(sum(values[name] ** 2 for name in ('qx', 'qy', 'qz', 'qw')))
        return np.asarray(np.abs(length - 1.0) <= QUATERNION_TOLERANCE)


def _yaw(values: dict[str, npt.NDArray[Any]]) -> npt.NDArray[np.float64]:
    x, y, z, w = (values[name] for name in ('qx', 'qy', 'qz', 'qw'))
    with np.errstate(over='ignore', invalid='ignore'):
        return np.asarray(np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z))


def _cells(
    columns: Columns, grid: Grid, name: str, reach: npt.NDArray[np.int64], fitted: bool,
) -> npt.NDArray[np.int64]:
    """Return the cells of the robot; refuse grids that are off the cells of the workspace."""
    values, reach = columns.values, reach[:, np.newaxis]
    with np.errstate(over='ignore', invalid='ignore'):
        place = np.stack([values['y'] - grid.origin_y, values['x'] - grid.origin_x], axis=1)
        place = place / grid.resolution
        nearest = np.round(place)
        aligned = np.all(np.abs(place - nearest) <= ALIGNMENT_TOLERANCE, axis=1)
        low, high = (-FAR_AWAY, FAR_AWAY) if fitted else (0, np.array(grid.shape))
        inside = np.all((nearest >= low - reach) & (nearest < high - reach), axis=1)
    _refuse(columns, ~aligned, f'{name}: origin lies off the cells of the workspace')
    _refuse(columns, ~inside, f'{name}: its middle lies outside the workspace')
    return np.where((aligned & inside)[:, np.newaxis], nearest + reach, 0).astype(np.int64)


def _mask(data: npt.NDArray[np.int8], state: int) -> npt.NDArray[np.uint8]:
    mask = np.zeros(len(data), dtype=np.uint8)
    for heading in range(N_HEADINGS):
        place = 3 * (1 + int(STEP_ROW[heading])) + 1 + int(STEP_COL[heading])
        mask |= (data[:, place] == state).astype(np.uint8) << np.uint8(heading)
    return mask
