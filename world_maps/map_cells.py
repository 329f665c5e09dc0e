"""From pixels to cells by the rules of map_server (Jazzy, 1.3.7 and later)."""

from typing import Final

import numpy as np
import numpy.typing as npt

from world_maps.map_image import Bytes, Pixels

#: The values of an OccupancyGrid.
UNKNOWN: Final = -1
_FREE: Final = 0
_OCCUPIED: Final = 100
#: What Nav2's map saver writes for unknown in mode trinary.
SAVED_UNKNOWN: Final = 205
MODES: Final = ('trinary', 'scale', 'raw')


def cells_from_pixels(
    pixels: Pixels, mode: str, negate: bool, occupied_thresh: float, free_thresh: float,
) -> npt.NDArray[np.int8]:
    """
    Return the OccupancyGrid that map_server makes of an image, value by value.

    Parameters
    ----------
    pixels : Pixels
        The image, first row at its top.
    mode : str
        One of `MODES`.
    negate, occupied_thresh, free_thresh
        As in the YAML file.

    Returns
    -------
    ndarray of int8, shape (n_rows, n_cols)
        0 to 100, and -1 for unknown; row 0 at the lowest y.

    """
    if mode == 'raw':
        cells = np.where(pixels.grey <= _OCCUPIED, pixels.grey, UNKNOWN).astype(np.int8)
    else:
        cells = _thresholded(
            _darkness(pixels.grey, negate), occupied_thresh, free_thresh, mode == 'scale')
        cells[pixels.alpha < 255] = UNKNOWN
    return np.ascontiguousarray(cells[::-1])


def n_saved_unknown_free(pixels: Pixels, cells: npt.NDArray[np.int8]) -> int:
    """Return how many pixels of the grey that the map saver writes for unknown became free."""
    return int(((pixels.grey == SAVED_UNKNOWN) & (cells[::-1] == _FREE)).sum())


def _darkness(grey: Bytes, negate: bool) -> npt.NDArray[np.float32]:
    """Return how occupied each pixel is, 0 to 1, in map_server's own precision."""
    shade = grey.astype(np.float32) / np.float32(255.0)
    return shade if negate else np.float32(1.0) - shade


def _thresholded(
    occupied: npt.NDArray[np.float32], occupied_thresh: float, free_thresh: float, scaled: bool,
) -> npt.NDArray[np.int8]:
    high, low = np.float32(occupied_thresh), np.float32(free_thresh)
    cells = np.full(occupied.shape, UNKNOWN, dtype=np.int8)
    cells[occupied >= high] = _OCCUPIED
    cells[occupied <= low] = _FREE
    if scaled:
        between = (occupied > low) & (occupied < high)
        span = np.float32(occupied_thresh - free_thresh)
        percent = (occupied[between] - low) / span * np.float32(100.0)
        cells[between] = np.floor(percent.astype(float) + 0.5).astype(np.int8)
    return cells


def turned(cells: npt.NDArray[np.int8], quarters: int) -> npt.NDArray[np.int8]:
    """Return a grid (row 0 at the lowest y) after so many quarter turns counter-clockwise."""
    # np.rot90 turns what has its first row at the top.
    return np.ascontiguousarray(np.rot90(cells[::-1], quarters)[::-1])


def turned_corner(
    corner: tuple[float, float], shape: tuple[int, int], resolution: float, quarters: int,
) -> tuple[float, float]:
    """
    Return the lower left corner of a grid that is turned about what was its lower left corner.

    Parameters
    ----------
    corner : tuple of float
        (x, y) of the corner that the grid is turned about, [m].
    shape : tuple of int
        (n_rows, n_cols) before it is turned.
    resolution : float
        Side of a cell [m].
    quarters : int
        Quarter turns counter-clockwise, 0 to 3.

    """
    height, width = shape[0] * resolution, shape[1] * resolution
    left, down = ((0.0, 0.0), (height, 0.0), (width, height), (0.0, width))[quarters]
    return corner[0] - left, corner[1] - down
