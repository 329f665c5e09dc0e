"""What RViz draws: the field as lines, its prototypes as spheres, what moves as cylinders."""

from collections.abc import Sequence
import math
from typing import Final

from geometry_msgs.msg import Point
import numpy as np
import numpy.typing as npt
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from control_field.grid import Grid
from control_field.records import ControlField, Prototypes

#: Arrows drawn at most; of a greater field every second, third, ... cell is drawn.
MAX_ARROWS: Final = 2500
#: Where lines and spheres are drawn above the floor, [m].
HEIGHT: Final = 0.02
#: How high what moves is drawn, [m].
_MOVER_HEIGHT: Final = 0.3
_N_COLOURS: Final = 16
#: From low to high: red, yellow, green.
_RAMP: Final = ((0.84, 0.19, 0.15), (0.99, 0.88, 0.45), (0.10, 0.60, 0.31))
#: A stroke from tail to tip, and two back from the tip: along and across the course.
_STROKES: Final = np.array([[-0.4, 0.0], [0.4, 0.0], [0.4, 0.0], [0.15, 0.15],
                            [0.4, 0.0], [0.15, -0.15]])


def markers_from_field(field: ControlField, prototypes: Prototypes) -> MarkerArray:
    """
    Draw a field and its prototypes.

    Parameters
    ----------
    field : ControlField
        Drawn as arrows, coloured by coherence from red (0) to green (1).
    prototypes : Prototypes
        Drawn as spheres, coloured by Q-value from red (the least) to green (the greatest).

    Returns
    -------
    MarkerArray
        One LINE_LIST and one SPHERE_LIST, in the field's frame, with a zero stamp.

    """
    return MarkerArray(markers=[_arrows(field), _spheres(prototypes, field.grid)])


def _arrows(field: ControlField) -> Marker:
    grid = field.grid
    marker = _marker('control_field', Marker.LINE_LIST, grid)
    marker.scale.x = 0.04 * grid.resolution
    has_heading = (field.vx != 0.0) | (field.vy != 0.0)
    stride = max(math.ceil(math.sqrt(np.count_nonzero(has_heading) / MAX_ARROWS)), 1)
    cells = stride * np.argwhere(has_heading[::stride, ::stride])
    rows, cols = cells.T
    along = np.stack([field.vx[rows, cols], field.vy[rows, cols]], axis=1).astype(np.float64)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    size = grid.resolution * stride
    tips = grid.world_from_cells(cells)[:, np.newaxis] + size * (
        _STROKES[:, :1] * along[:, np.newaxis] + _STROKES[:, 1:] * across[:, np.newaxis])
    _fill(marker, tips.reshape(-1, 2),
          np.repeat(field.coherence[rows, cols], len(_STROKES)))
    return marker


def _spheres(prototypes: Prototypes, grid: Grid) -> Marker:
    marker = _marker('prototypes', Marker.SPHERE_LIST, grid)
    marker.scale.x = marker.scale.y = marker.scale.z = 0.3 * grid.resolution
    low, high = (prototypes.q.min(), prototypes.q.max()) if len(prototypes) else (0.0, 0.0)
    share = (prototypes.q - low) / (high - low) if high > low else np.ones(len(prototypes))
    _fill(marker, grid.world_from_cells(prototypes.cells), share)
    return marker


def _marker(name: str, kind: int, grid: Grid) -> Marker:
    marker = Marker(ns=name, id=0, type=kind, action=Marker.ADD)
    marker.header.frame_id = grid.frame_id
    marker.pose.orientation.w = 1.0
    marker.color.a = 1.0
    return marker


def _fill(
    marker: Marker, points: npt.NDArray[np.float64], shares: npt.NDArray[np.floating],
) -> None:
    """Give a list marker its points and their colours; RViz wants none without points."""
    if not len(points):
        marker.action = Marker.DELETE
        return
    marker.points = [Point(x=x, y=y, z=HEIGHT) for x, y in points.tolist()]
    palette = [_colour(i / (_N_COLOURS - 1)) for i in range(_N_COLOURS)]
    places = np.rint(np.clip(shares, 0.0, 1.0) * (_N_COLOURS - 1)).astype(np.int64)
    marker.colors = [palette[place] for place in places.tolist()]


def _colour(share: float) -> ColorRGBA:
    at = share * (len(_RAMP) - 1)
    i = min(int(at), len(_RAMP) - 2)
    red, green, blue = (
        low + (at - i) * (high - low) for low, high in zip(_RAMP[i], _RAMP[i + 1], strict=True))
    return ColorRGBA(r=red, g=green, b=blue, a=1.0)


def markers_from_discs(
    discs: Sequence[tuple[float, float, float] | None], frame_id: str,
) -> MarkerArray:
    """
    Draw what moves.

    Parameters
    ----------
    discs : sequence of (x, y, radius) or None, [m]
        None for what is not there now.
    frame_id : str

    Returns
    -------
    MarkerArray
        A cylinder each, with a zero stamp; those of what is not there are taken away.

    """
    markers = []
    for number, disc in enumerate(discs):
        marker = Marker(ns='movers', id=number, type=Marker.CYLINDER, action=Marker.DELETE)
        marker.header.frame_id = frame_id
        if disc is not None:
            marker.action, marker.color = Marker.ADD, _colour(0.5)
            marker.pose.orientation.w = 1.0
            marker.pose.position = Point(x=disc[0], y=disc[1], z=0.5 * _MOVER_HEIGHT)
            marker.scale.x = marker.scale.y = 2.0 * disc[2]
            marker.scale.z = _MOVER_HEIGHT
        markers.append(marker)
    return MarkerArray(markers=markers)
