"""The three tables on the wire: the control field, the prototypes, the experience."""

import array
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import PointCloud2, PointField

from control_field.grid import Grid
from control_field.headings import N_HEADINGS, UNIT
from control_field.local_grid import BLOCKED, UNKNOWN
from control_field.records import CellFlag, ControlField, DECISION_DTYPE, Kind, Prototypes
from msgs_bridge.messages.clouds import (
    check_column, check_in, cloud_from_table, cloud_of, columns_from_cloud, first_bad,
    table_from_cloud, TableError)
from msgs_bridge.messages.slices import check_slices, copied, slices

#: Version of all three tables.
VERSION: Final = 1
#: Cells have coordinates below this in every direction.
MAX_CELL: Final = 100_000
_XYZ: Final = [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('version', 'u1')]

#: One point a cell. Aligned, so that C++ readers may point into it; the gaps are zero.
FIELD_DTYPE: Final[np.dtype[np.void]] = np.dtype([
    *_XYZ, ('flags', 'u1'), ('known', 'i1'), ('revision', '<u4'),
    ('resolution', '<f8'), ('origin_x', '<f8'), ('origin_y', '<f8'),
    ('vx', '<f4'), ('vy', '<f4'), ('coherence', '<f4'), ('q', '<f4', (N_HEADINGS,))], align=True)
#: One point a prototype.
PROTOTYPE_DTYPE: Final[np.dtype[np.void]] = np.dtype([
    *_XYZ, ('heading', 'i1'), ('demonstrated', 'u1'), ('row', '<i4'), ('col', '<i4'),
    ('episode', '<i4'), ('stamp', '<f8'), ('vx', '<f4'), ('vy', '<f4'), ('q', '<f8')], align=True)
#: One point a decision.
EXPERIENCE_DTYPE: Final[np.dtype[np.void]] = np.dtype(
    [*_XYZ, *((name, DECISION_DTYPE[name]) for name in DECISION_DTYPE.names or ())], align=True)
#: What the name of the column that names the memory begins with, and how long that name may be.
_MEMORY: Final = 'memory:'
_LONGEST: Final = 100
_VERSION_DTYPE: Final[np.dtype[np.void]] = np.dtype([('version', 'u1')])
_GOAL_DTYPE: Final[np.dtype[np.void]] = np.dtype([
    ('flags', 'u1'), ('resolution', '<f8'), ('origin_x', '<f8'), ('origin_y', '<f8')])


class OtherVersionError(TableError):
    """A table of a version that is not known here."""


def cloud_from_field(field: ControlField) -> PointCloud2:
    """
    Write a control field, organised rows x cols; equal fields give equal bytes.

    Its memory is the name of one more column, which lies on that of the version: readers that do
    not know it pass it over, and the bytes of the table are the same with and without.
    """
    grid = field.grid
    data = array.array('B', b'\0') * (grid.n_rows * grid.n_cols * FIELD_DTYPE.itemsize)
    table = np.frombuffer(data, FIELD_DTYPE).reshape(grid.shape)
    for rows in slices(grid.shape):
        _fill_rows(table[rows], field, rows)
    # The record keeps the goal beside the flags; on the wire the flag is all there is.
    table['flags'][field.goal] |= CellFlag.GOAL
    msg = cloud_of(FIELD_DTYPE, data, grid.frame_id, grid.shape)
    if field.memory:
        [version] = (column for column in msg.fields if column.name == 'version')
        msg.fields.append(PointField(name=_MEMORY + field.memory, offset=version.offset,
                                     datatype=version.datatype, count=1))
    return msg


def _fill_rows(table: npt.NDArray[np.void], field: ControlField, rows: slice) -> None:
    """Fill some rows of the table of a field: while they are near, all their columns."""
    grid = field.grid
    _fill_place(table, grid, np.arange(rows.start, rows.stop)[:, np.newaxis],
                np.arange(grid.n_cols))
    table['resolution'] = grid.resolution
    table['origin_x'], table['origin_y'] = grid.origin_x, grid.origin_y
    table['revision'] = field.revision
    for name in ('flags', 'known', 'vx', 'vy', 'coherence', 'q'):
        table[name] = getattr(field, name)[rows]
    table['flags'] &= 0xFF ^ CellFlag.GOAL


def field_from_cloud(msg: Any) -> ControlField:
    """
    Read a control field, slice by slice.

    Raises
    ------
    TableError
        If the message is no such table, of an unknown version, or a value cannot be: not
        finite, no unit vector, no cell state, no or several goals, points off the grid.

    """
    columns = _columns(msg)
    flags = columns['flags']
    if not flags.size:
        raise TableError('control_field: it has no cells')
    grid = _grid(columns, msg.header.frame_id)
    goals = [(row + rows.start, col) for rows in slices(flags.shape)
             for row, col in np.argwhere(flags[rows] & CellFlag.GOAL)[:2].tolist()]
    if len(goals) != 1:
        n = sum(int(((flags[rows] & CellFlag.GOAL) > 0).sum()) for rows in slices(flags.shape))
        raise TableError(f'control_field: {n} cells hold the flag GOAL, must be 1')
    _check_field(columns)
    copies = {name: copied(columns[name])
              for name in ('vx', 'vy', 'coherence', 'q', 'known', 'flags')}
    return ControlField(grid=grid, revision=int(columns['revision'][0, 0]), goal=goals[0],
                        memory=_memory(msg), **copies)


def _columns(msg: Any) -> dict[str, npt.NDArray[Any]]:
    """Find the columns of a field, the version first: another may well have other columns."""
    name = 'control_field'
    try:
        check_slices(name, 'version', columns_from_cloud(msg, _VERSION_DTYPE)['version'],
                     lambda part, _: part == VERSION, str(VERSION), OtherVersionError)
        return columns_from_cloud(msg, FIELD_DTYPE)
    except OtherVersionError:
        raise
    except TableError as error:
        raise TableError(f'{name}: {error}') from None


def _memory(msg: Any) -> str:
    """Return whose field it is; empty where nobody says, or more than one."""
    found = [column.name.removeprefix(_MEMORY) for column in msg.fields
             if column.name.startswith(_MEMORY)]
    return found[0][:_LONGEST] if len(found) == 1 and found[0].isprintable() else ''


def cloud_from_prototypes(prototypes: Prototypes, grid: Grid) -> PointCloud2:
    """Write the prototypes on the cells of ``grid``."""
    table = np.zeros(len(prototypes), dtype=PROTOTYPE_DTYPE)
    table['row'], table['col'] = prototypes.cells.T
    _fill_place(table, grid, prototypes.cells[:, 0], prototypes.cells[:, 1])
    for name, values in (
            ('heading', prototypes.headings), ('demonstrated', prototypes.demonstrated),
            ('episode', prototypes.episodes), ('stamp', prototypes.stamps), ('q', prototypes.q)):
        table[name] = values
    table['vx'], table['vy'] = UNIT[prototypes.headings].T
    return cloud_from_table(table, grid.frame_id)


def prototypes_from_cloud(msg: Any) -> Prototypes:
    """
    Read the prototypes.

    Raises
    ------
    TableError
        If the message is no such table, of an unknown version, a value cannot be, or a cell
        stands twice or out of order.

    """
    name = 'prototypes'
    table = _table(msg, PROTOTYPE_DTYPE, name).reshape(-1)
    check_in(name, 'heading', table['heading'], range(N_HEADINGS))
    check_in(name, 'demonstrated', table['demonstrated'], (0, 1))
    check_column(name, 'q', table['q'], np.isfinite(table['q']), 'finite')
    check_column(name, 'stamp', table['stamp'], ~np.isinf(table['stamp']), 'seconds or NaN')
    cells = _cells(table, name, 'row', 'col')
    order = cells[:, 0].astype(np.int64) * MAX_CELL + cells[:, 1]
    place = first_bad(np.diff(order) > 0)
    if place is not None:
        raise TableError(f'prototypes: cell {tuple(cells[place[0] + 1].tolist())} must come '
                         f'once, ordered by row, then column')
    return Prototypes(
        cells=cells, headings=table['heading'].copy(), q=table['q'].copy(),
        episodes=table['episode'].copy(), stamps=table['stamp'].copy(),
        demonstrated=table['demonstrated'].astype(np.bool_))


def cloud_from_decisions(decisions: npt.NDArray[np.void], grid: Grid) -> PointCloud2:
    """Write rows of DECISION_DTYPE, shape (n,), each at the centre of its cell."""
    table = np.zeros(decisions.shape, dtype=EXPERIENCE_DTYPE)
    _fill_place(table, grid, decisions['row'], decisions['col'])
    for name in DECISION_DTYPE.names or ():
        table[name] = decisions[name]
    return cloud_from_table(table, grid.frame_id)


def goal_from_cloud(msg: Any) -> tuple[float, float] | None:
    """Return the goal of a control field, ``(x, y)`` [m], unchecked; None if it has none."""
    table = table_from_cloud(msg, _GOAL_DTYPE)
    goals = np.argwhere(table['flags'] & CellFlag.GOAL)
    if len(goals) != 1:
        return None
    row, col = goals[0].tolist()
    _, side, x, y = table[row, col].tolist()
    return x + (col + 0.5) * side, y + (row + 0.5) * side


def decisions_from_cloud(msg: Any, grid: Grid | None = None) -> npt.NDArray[np.void]:
    """
    Read decisions.

    Parameters
    ----------
    msg : PointCloud2
        What arrived.
    grid : Grid, optional
        The workspace: with it, frame and cells are checked against it too.

    Returns
    -------
    ndarray of DECISION_DTYPE, shape (n,)

    Raises
    ------
    TableError
        If the message is no such table, of an unknown version, or a value cannot be.

    """
    table = _table(msg, EXPERIENCE_DTYPE, 'experience').reshape(-1)
    if grid is not None:
        _check_frame(msg, grid)
    decisions = _decisions(table)
    check_decisions(decisions, grid)
    return decisions


def decisions_by_place(msg: Any, grid: Grid) -> npt.NDArray[np.void]:
    """
    Read decisions that were made in any workspace of the lattice of ``grid``.

    Parameters
    ----------
    msg : PointCloud2
        What arrived.
    grid : Grid

    Returns
    -------
    ndarray of DECISION_DTYPE, shape (n,)
        Their cells are those of ``grid``, by where the points lie; they may lie outside it.

    Raises
    ------
    TableError
        If the message is no such table, of an unknown version, or a value cannot be.

    """
    table = _table(msg, EXPERIENCE_DTYPE, 'experience').reshape(-1)
    _check_frame(msg, grid)
    decisions = _decisions(table)
    check_decisions(decisions, anywhere=True)
    for axis, origin, cells in (('x', grid.origin_x, ('col', 'next_col')),
                                ('y', grid.origin_y, ('row', 'next_row'))):
        # As it is written: in the same workspace nothing is left, however far away that is.
        centre = (origin + (table[cells[0]] + 0.5) * grid.resolution).astype(np.float32)
        with np.errstate(over='ignore', invalid='ignore'):
            off = (table[axis].astype(np.float64) - centre) / grid.resolution
        check_column('experience', axis, table[axis], np.abs(off) < MAX_CELL,
                     f'within {MAX_CELL} cells of the workspace')
        for name in cells:
            decisions[name] += np.round(off).astype(np.int32)
    return decisions


def _check_frame(msg: Any, grid: Grid) -> None:
    if msg.header.frame_id != grid.frame_id:
        raise TableError(f'experience: frame is {msg.header.frame_id[:80]!r}, '
                         f'must be {grid.frame_id!r}')


def _decisions(table: npt.NDArray[np.void]) -> npt.NDArray[np.void]:
    decisions = np.zeros(table.shape, dtype=DECISION_DTYPE)
    for name in DECISION_DTYPE.names or ():
        decisions[name] = table[name]
    return decisions


def check_decisions(
    decisions: npt.NDArray[np.void], grid: Grid | None = None, anywhere: bool = False,
) -> None:
    """
    Refuse decisions that cannot be; see `decisions_from_cloud` and `decisions_by_place`.

    Parameters
    ----------
    decisions : ndarray of DECISION_DTYPE, shape (n,)
    grid : Grid, optional
        The workspace.
    anywhere : bool
        Whether cells may lie outside it, negative ones too.

    Raises
    ------
    TableError
        Naming the column, the row and the value.

    """
    name = 'experience'
    check_column(name, 'stamp', decisions['stamp'],
                 np.isfinite(decisions['stamp']) & (decisions['stamp'] >= 0.0), 'seconds')
    check_in(name, 'action', decisions['action'], range(N_HEADINGS))
    check_in(name, 'reward', decisions['reward'], (-1, 0, 1))
    check_in(name, 'kind', decisions['kind'], [int(kind) for kind in Kind])
    low = -MAX_CELL if anywhere else 0
    here = _cells(decisions, name, 'row', 'col', grid, low)
    there = _cells(decisions, name, 'next_row', 'next_col', grid, low)
    place = first_bad(np.abs(there - here).max(axis=1, initial=0) <= 1)
    if place is not None:
        raise TableError(f'experience: the step from {tuple(here[place[0]].tolist())} leads to '
                         f'{tuple(there[place[0]].tolist())}, must lead to a neighbour')


def _fill_place(
    table: npt.NDArray[np.void], grid: Grid,
    rows: npt.NDArray[np.integer[Any]], cols: npt.NDArray[np.integer[Any]],
) -> None:
    table['version'] = VERSION
    table['x'] = grid.origin_x + (cols + 0.5) * grid.resolution
    table['y'] = grid.origin_y + (rows + 0.5) * grid.resolution


def _table(msg: Any, dtype: np.dtype[np.void], name: str) -> npt.NDArray[np.void]:
    """Read a table, its version first: another version may well have other columns."""
    try:
        versions = table_from_cloud(msg, _VERSION_DTYPE)['version']
        place = first_bad(versions == VERSION)
        if place is not None:
            raise OtherVersionError(
                f'{name}: version is {versions[place]} at {place}, must be {VERSION}')
        return table_from_cloud(msg, dtype)
    except OtherVersionError:
        raise
    except TableError as error:
        raise TableError(f'{name}: {error}') from None


def _cells(
    table: npt.NDArray[np.void], name: str, row: str, col: str, grid: Grid | None = None,
    low: int = 0,
) -> npt.NDArray[np.int32]:
    shape = grid.shape if grid is not None else (MAX_CELL, MAX_CELL)
    for column, n in zip((row, col), shape, strict=True):
        values = table[column]
        check_column(name, column, values, (values >= low) & (values < n), f'{low} to {n - 1}')
    return np.stack([table[row], table[col]], axis=-1).astype(np.int32)


def _grid(columns: dict[str, npt.NDArray[Any]], frame_id: str) -> Grid:
    """Return the workspace, and see that every point lies at the centre of its cell."""
    name = 'control_field'
    first = {column: columns[column][0, 0]
             for column in ('revision', 'resolution', 'origin_x', 'origin_y')}
    for column, value in first.items():
        check_slices(name, column, columns[column], partial(_are, value), f'{value} everywhere')
    try:
        grid = Grid(columns['x'].shape[0], columns['x'].shape[1], float(first['resolution']),
                    float(first['origin_x']), float(first['origin_y']), frame_id)
    except ValueError as error:
        raise TableError(f'{name}: {error}') from None
    cols = grid.origin_x + (np.arange(grid.n_cols) + 0.5) * grid.resolution
    rows = (grid.origin_y + (np.arange(grid.n_rows) + 0.5) * grid.resolution)[:, np.newaxis]
    near = partial(_are_near, grid.resolution)
    must = 'the centre of its cell'
    check_slices(name, 'x', columns['x'], lambda part, _: near(part, cols), must)
    check_slices(name, 'y', columns['y'], lambda part, where: near(part, rows[where]), must)
    return grid


def _are(value: Any, part: npt.NDArray[Any], _: slice) -> npt.NDArray[np.bool_]:
    same: npt.NDArray[np.bool_] = part == value
    return same


def _are_near(
    resolution: float, part: npt.NDArray[Any], centre: npt.NDArray[Any],
) -> npt.NDArray[np.bool_]:
    """Return which coordinates are those of the centres of cells, but for rounding."""
    with np.errstate(over='ignore', invalid='ignore'):
        near: npt.NDArray[np.bool_] = (
            np.abs(part - centre) <= 0.01 * resolution + 2e-7 * np.abs(centre))
    return near


def _check_field(columns: dict[str, npt.NDArray[Any]]) -> None:
    """Refuse values that no learner makes."""
    check = partial(check_slices, 'control_field')
    for column in ('vx', 'vy', 'coherence', 'q'):
        check(column, columns[column], lambda part, _: np.isfinite(part), 'finite')
    for rows in slices(columns['vx'].shape):
        length = np.hypot(columns['vx'][rows].astype(np.float64), columns['vy'][rows])
        good = (length == 0.0) | (np.abs(length - 1.0) < 1e-3)
        if (place := first_bad(good)) is not None:
            raise TableError(f'control_field: length of (vx, vy) is {length[place]} at '
                             f'{(place[0] + rows.start, place[1])}, must be 0 or 1')
    check('coherence', columns['coherence'],
          lambda part, _: (part >= 0.0) & (part <= 1.001), '0 to 1')
    check('known', columns['known'],
          lambda part, _: (part >= UNKNOWN) & (part <= BLOCKED), '-1 to 100')
    check('flags', columns['flags'], lambda part, _: part < 16, 'below 16')
