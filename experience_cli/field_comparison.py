"""Two fields side by side: where they differ, and by how much."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
import math
from pathlib import Path
from typing import Any, BinaryIO, Final
import zipfile

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.headings import headings_from_vectors, N_HEADINGS, UNIT
from control_field.learning.certificate import Certificate, certify
from control_field.local_grid import UNKNOWN
from control_field.parameters import Parameters
from control_field.records import CellFlag, ControlField, Prototypes
from control_field.robot.policy import rules_of
from control_field.windows import moved
from episode_store.episode import Episode
from episode_store.relearn import relearn
from episode_store.task_folder import EpisodeFolder
from experience_cli.bag_argument import find_whole_bag, named_path, task_folder
from experience_cli.bag_summary import grid_text
from experience_cli.errors import UserError
from msgs_bridge.untrusted.files import open_regular

#: Largest saved field that is read, unpacked, [bytes]; the largest workspace has 0.8 GB.
_MOST_UNPACKED: Final = 2**30


@dataclass(frozen=True, eq=False)
class Side:
    """
    One of the two fields.

    Parameters
    ----------
    name : str
        For people.
    field : ControlField
    prototypes : Prototypes
    parameters : Parameters
        It was made with.
    frame_known : bool
        Whether the frame is known (a saved field does not say).
    revision_known : bool
        Whether it is known from how many bags it was learnt.
    alone : Side or None
        The same in its own workspace, if that is a smaller one.

    """

    name: str
    field: ControlField
    prototypes: Prototypes
    parameters: Parameters
    frame_known: bool = True
    revision_known: bool = True
    alone: 'Side | None' = None

    @property
    def title(self) -> str:
        """Return the name as a figure can show it, whatever the bytes of a path are."""
        return self.name.encode(errors='replace').decode().replace('$', r'\$')

    @cached_property
    def headings(self) -> npt.NDArray[np.int8]:
        """Return the heading of every cell, -1 for none."""
        return headings_from_vectors(self.field.vx, self.field.vy)

    @cached_property
    def centres(self) -> npt.NDArray[np.int8]:
        """Return the heading of the prototype in every cell, -1 for none."""
        centres = np.full(self.field.grid.shape, -1, dtype=np.int8)
        centres[tuple(self.prototypes.cells.T)] = self.prototypes.headings
        return centres

    @cached_property
    def certificate(self) -> Certificate:
        """Return the certificate of the field on its own remembered map."""
        if self.alone is not None:
            found = self.alone.certificate
            off = np.subtract(self.field.goal, self.alone.field.goal)
            return replace(found, sinks=(found.sinks + off).astype(np.int32),
                           doubted=(found.doubted + off).astype(np.int32))
        demonstrated = np.full(self.field.grid.shape, -1, dtype=np.int8)
        own = self.prototypes.demonstrated
        demonstrated[tuple(self.prototypes.cells[own].T)] = self.prototypes.headings[own]
        return certify(
            self.field, demonstrated, len(self.prototypes), rules_of(self.parameters))

    def in_workspace(self, grid: Grid) -> 'Side':
        """Return it in a larger workspace of the same lattice; new cells have no heading."""
        field, own = self.field, replace(self.field.grid, frame_id=grid.frame_id)
        if own == grid:
            return self
        offset = own.offset_to(grid)
        assert offset is not None
        layers: dict[str, Any] = {
            name: moved(getattr(field, name), own, grid, UNKNOWN if name == 'known' else 0)
            for name in ('vx', 'vy', 'coherence', 'q', 'known', 'flags')}
        goal = field.goal[0] + offset[0], field.goal[1] + offset[1]
        cells = (self.prototypes.cells + np.array(offset)).astype(np.int32)
        return replace(self, alone=self, field=replace(field, grid=grid, goal=goal, **layers),
                       prototypes=replace(self.prototypes, cells=cells))


def side_from(text: str, bags: Path | None) -> Side:
    """
    Return the field that a person names.

    Parameters
    ----------
    text : str
        A saved field (``.npz``), the folder of a task (what its bags teach), or a bag (what it
        was driven on).
    bags : Path or None
        The folder of all tasks.

    Raises
    ------
    UserError
        If it is none of these, or holds no field.
    BagError
        If it cannot be read.

    """
    path = Path(text)
    if path.suffix == '.npz':
        return _side_from_file(path)
    path = named_path(path, bags)
    task = task_folder(path)
    if task is not None:
        return side_from_bags(text, task.episodes())
    episode = Episode(find_whole_bag(text, bags))
    field, prototypes = episode.field(), episode.prototypes()
    if field is None or prototypes is None:
        raise UserError(f'{text} holds no field: none was in force when it was recorded')
    return Side(episode.folder.name, field, prototypes, episode.header.parameters)


def side_from_bags(text: str, episodes: Sequence[EpisodeFolder]) -> Side:
    """
    Return what some bags teach.

    Parameters
    ----------
    text : str
        As a person named them.
    episodes : sequence of EpisodeFolder

    Raises
    ------
    UserError
        If there is no demonstration among them.
    BagError
        If one cannot be read.

    """
    relearner, _ = relearn(episodes)
    if relearner is None or relearner.refresh is None:
        raise UserError(f'{text} holds no demonstration: there is no field to compare')
    return Side(text, relearner.refresh.field, relearner.refresh.prototypes, relearner.parameters)


def _side_from_file(path: Path) -> Side:
    try:
        with open_regular(path) as stream:
            _check_unpacked(stream)
            with np.load(stream, allow_pickle=False) as file:
                return _side_from_arrays(path, dict(file))
    except OSError as error:
        raise UserError(f'cannot read {path}: {error.strerror or error}') from None
    except Exception as error:
        # Unpacking raises what it runs into, of many types, on a file that is damaged.
        text = f'it has no {error}' if isinstance(error, KeyError) else str(error)
        raise UserError(f'{path} is no saved field: {text or type(error).__name__}') from None


def _check_unpacked(stream: BinaryIO) -> None:
    """Refuse a file that unpacks to too much: a few kB of it may fill all memory."""
    with zipfile.ZipFile(stream) as packed:
        n_bytes = sum(member.file_size for member in packed.infolist())
    if n_bytes > _MOST_UNPACKED:
        raise ValueError(f'it has {n_bytes} bytes unpacked, must be at most {_MOST_UNPACKED}')
    stream.seek(0)


def _side_from_arrays(path: Path, arrays: Mapping[str, npt.NDArray[Any]]) -> Side:
    """Read what `experience learn --save` and `evaluate --save-field` write."""
    vx = arrays['vx']
    (n_rows, n_cols), (x, y) = vx.shape, arrays['origin'].tolist()
    grid = Grid(n_rows, n_cols, float(arrays['resolution']), x, y)
    cells = grid.cells_from_world(arrays['centres'].reshape(-1, 2)).astype(np.int32)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    n = len(cells)
    actions = arrays['actions'].reshape(-1, 2)
    prototypes = Prototypes(
        cells=cells[order], headings=headings_from_vectors(actions[:, 0], actions[:, 1])[order],
        q=arrays['q'].astype(np.float64)[order], episodes=np.zeros(n, dtype=np.int32),
        stamps=np.full(n, np.nan),
        demonstrated=arrays.get('demonstrated', np.zeros(n)).astype(np.bool_)[order])
    length = np.hypot(vx, arrays['vy'])
    flags = np.zeros(grid.shape, dtype=np.uint8)
    flags[tuple(prototypes.cells.T)] = CellFlag.PROTOTYPE
    field = ControlField(
        grid=grid, revision=int(arrays.get('revision', 0)), goal=_goal(grid, arrays),
        vx=vx.astype(np.float32), vy=arrays['vy'].astype(np.float32),
        coherence=np.minimum(length, 1.0).astype(np.float32),
        q=arrays.get('q_matrix', np.zeros((*grid.shape, N_HEADINGS))).astype(np.float32),
        known=arrays.get('known', np.full(grid.shape, -1)).astype(np.int8), flags=flags)
    return Side(str(path), field, prototypes, Parameters(), frame_known=False,
                revision_known='revision' in arrays)


def _goal(grid: Grid, arrays: Mapping[str, npt.NDArray[Any]]) -> tuple[int, int]:
    """Return the goal's cell: `learn` writes row and column, `evaluate` a place in metres."""
    goal = arrays.get('goal', np.zeros(2, dtype=np.int64))
    if np.issubdtype(goal.dtype, np.floating):
        return grid.cell_from_world(float(goal[0]), float(goal[1]))
    return int(goal[0]), int(goal[1])


@dataclass(frozen=True, eq=False)
class Comparison:
    """
    What differs between two fields on the same cells.

    Parameters
    ----------
    first, second : Side
        In one workspace, see `Comparison.of`.
    shared : ndarray of bool, shape (n_rows, n_cols)
        The cells that both had before: only there headings are compared.

    """

    first: Side
    second: Side
    shared: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, first: Side, second: Side) -> 'Comparison':
        """
        Return the comparison of two fields, in a workspace that holds both.

        Raises
        ------
        UserError
            If they are not on the same cells; the message names both.

        """
        one, other = first.field.grid, second.field.grid
        if not (first.frame_known and second.frame_known):
            other = replace(other, frame_id=one.frame_id)
        offset = other.offset_to(one)
        if offset is None:
            raise UserError(f'{first.name} is of {grid_text(one)}, {second.name} of '
                            f'{grid_text(second.field.grid)}: they cannot be compared')
        grid = one.window(one.box.union(other.box.shifted(*offset)))
        shared = np.ones(grid.shape, dtype=np.bool_)
        for own in (one, other):
            shared &= moved(np.ones(own.shape, dtype=np.bool_), own, grid, False)
        return cls(first.in_workspace(grid), second.in_workspace(grid), shared)

    @cached_property
    def turned(self) -> npt.NDArray[np.bool_]:
        """Return in which of the cells that both have the headings differ."""
        return np.asarray(self.shared & (self.first.headings != self.second.headings))

    @cached_property
    def angle(self) -> npt.NDArray[np.float64]:
        """Return by how much the headings differ, [rad], 0 to pi; NaN where one has none."""
        a, b = self.first, self.second
        inner = (a.field.vx.astype(np.float64) * b.field.vx
                 + a.field.vy.astype(np.float64) * b.field.vy)
        angle = np.arccos(np.clip(inner, -1.0, 1.0))
        return np.where((a.headings >= 0) & (b.headings >= 0), angle, np.nan)

    def prototypes(self) -> dict[str, npt.NDArray[np.int64]]:
        """Return the cells, shape (k, 2), of prototypes removed, added and turned."""
        a, b = self.first.centres, self.second.centres
        return {'removed': np.argwhere((a >= 0) & (b < 0)),
                'added': np.argwhere((a < 0) & (b >= 0)),
                'turned': np.argwhere((a >= 0) & (b >= 0) & (a != b))}

    def to_json(self) -> dict[str, Any]:
        """Return the numbers."""
        a, b = self.first.field, self.second.field
        known = ~np.isnan(self.angle)
        return {
            'first': _side_json(self.first), 'second': _side_json(self.second),
            'grid': asdict(self.first.field.grid),
            'cells': int(self.shared.sum()), 'cells_of_one_only': int((~self.shared).sum()),
            'courses_differ': int(self.turned.sum()),
            'courses_differ_cells': np.argwhere(self.turned).tolist(),
            'mean_angle_degrees': (
                math.degrees(float(self.angle[known].mean())) if known.any() else None),
            'largest_angle_degrees': (
                math.degrees(float(self.angle[known].max())) if known.any() else None),
            'vectors_equal': bool(
                ((a.vx == b.vx) & (a.vy == b.vy) | ~self.shared).all()),
            'largest_q_difference': float(np.abs(a.q - b.q)[self.shared].max(initial=0.0)),
            'remembered_map_differs': int((a.known != b.known).sum()),
            'goal_moved': a.goal != b.goal,
            'prototypes': {name: cells.tolist() for name, cells in self.prototypes().items()}}


def _side_json(side: Side) -> dict[str, Any]:
    certificate = side.certificate
    judged = bool((side.field.known == 0).any())
    return {
        'name': side.name, 'revision': side.field.revision if side.revision_known else None,
        'goal': list(side.field.goal),
        'goal_place': list(side.field.grid.world_from_cell(*side.field.goal)),
        'prototypes': len(side.prototypes),
        'basin': certificate.basin if judged else None,
        'proven': certificate.proven if judged else None, 'sinks': certificate.sinks.tolist(),
        'fidelity': None if math.isnan(certificate.fidelity) else certificate.fidelity,
        'doubted': certificate.doubted.tolist(), 'leaning': certificate.leaning,
        'known_cells': int((side.field.known >= 0).sum())}


def unit_vectors(headings: npt.NDArray[np.int8]) -> npt.NDArray[np.float64]:
    """Return the unit vector of headings, (0, 0) for none; shape (..., 2)."""
    return np.where(headings[..., np.newaxis] >= 0, UNIT[headings], 0.0)
