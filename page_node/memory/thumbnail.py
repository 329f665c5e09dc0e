"""A small picture of a drive: where it began, which way it went, and past which walls."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.task_folder import EpisodeKind
from page_node.memory.ground import ground_seen, Known
from page_node.memory.opened import reading
from page_node.memory.way import Way, way_of

#: Size, [px], and the space around, [px].
_WIDE, _HIGH, _SPACE = 120.0, 90.0, 7.0
#: Points of a way, at most.
_MOST_POINTS: Final = 160
#: Runs of walls that are drawn; more would be grey.
_MOST_WALLS: Final = 1500
#: Least size of what is shown, [m].
_SMALLEST: Final = 0.5
#: Told apart from a light and from a dark page.
_WALL, _WAY, _TRIED, _START = '#7d848c', '#2f7de1', '#a05bd0', '#2f7de1'
_GOAL, _FAILED = '#2a9d57', '#e0453f'


def thumbnail_of(bags: str, task: str, number: str) -> bytes:
    """Return the picture as SVG; `RefusedError` if there is no drive to be seen."""
    with reading(bags, task, number) as episode:
        way = way_of(episode)
        if not len(way):
            raise NothingToLearnError(episode.path, 'it holds no odometry')
        return _picture(way, *_ground(episode), _marks(episode)).encode()


def _ground(episode: Episode) -> tuple[Grid, Known]:
    field = episode.field()
    return ground_seen(episode) if field is None else (field.grid, field.known)


def _marks(episode: Episode) -> tuple[str, str]:
    """Return the colours of the way and of its end: not all trials come to the goal."""
    if episode.folder.kind is EpisodeKind.DEMO:
        return _WAY, _GOAL
    ended = episode.status
    return _TRIED, _GOAL if ended is not None and ended.outcome is Outcome.GOAL else _FAILED


def _picture(way: Way, grid: Grid, known: Known, marks: tuple[str, str]) -> str:
    place = _Place(way.xy, grid, known)
    points = way.xy[np.unique(np.linspace(0, len(way) - 1, _MOST_POINTS).astype(int))]
    line = ' '.join(f'{x:.1f},{y:.1f}' for x, y in place.on_picture(points))
    (x0, y0), (x1, y1) = place.on_picture(way.xy[[0, -1]])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDE:g} {_HIGH:g}">'
        f'<path fill="{_WALL}" d="{place.walls(grid, known)}"/>'
        f'<polyline fill="none" stroke="{marks[0]}" stroke-width="2.5" '
        f'stroke-linejoin="round" stroke-linecap="round" points="{line}"/>'
        f'<circle cx="{x0:.1f}" cy="{y0:.1f}" r="3.2" fill="none" stroke="{_START}" '
        f'stroke-width="2"/><circle cx="{x1:.1f}" cy="{y1:.1f}" r="3.6" fill="{marks[1]}"/></svg>')


class _Place:
    """Where a point of the world is on the picture: the way, and the walls known around it."""

    def __init__(self, xy: npt.NDArray[np.float64], grid: Grid, known: Known) -> None:
        points = np.concatenate([xy, grid.world_from_cells(np.argwhere(known > 0))])
        low, high = points.min(axis=0), points.max(axis=0)
        size = np.maximum(high - low, _SMALLEST)
        self._scale = float(((np.array([_WIDE, _HIGH]) - 2.0 * _SPACE) / size).min())
        self._middle = (low + high) / 2.0

    def on_picture(self, xy: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return points of the picture, [px]; y runs down."""
        off = (xy - self._middle) * self._scale
        return np.stack([_WIDE / 2.0 + off[:, 0], _HIGH / 2.0 - off[:, 1]], axis=1)

    def walls(self, grid: Grid, known: Known) -> str:
        """Return the walls as runs of cells along the rows."""
        side = grid.resolution * self._scale
        padded = np.pad(known > 0, ((0, 0), (1, 1))).astype(np.int8)
        row, first = np.nonzero(np.diff(padded, axis=1) == 1)
        _, end = np.nonzero(np.diff(padded, axis=1) == -1)
        corners = self.on_picture(grid.world_from_cells(np.stack([row, first], axis=1)))
        return ''.join(f'M{x - side / 2:.1f} {y - side / 2:.1f}h{n * side:.1f}v{side:.1f}'
                       f'h{-n * side:.1f}z' for (x, y), n in zip(
                           corners[:_MOST_WALLS], (end - first)[:_MOST_WALLS], strict=True))
