"""An image that is a world by itself: drawn by somebody, or a map without its YAML file."""

from pathlib import Path
from typing import Final

import numpy as np

from control_field.local_grid import BLOCKED, FREE
from world_maps.errors import read_bytes, WorldError
from world_maps.map_cells import SAVED_UNKNOWN
from world_maps.map_file import MapFile
from world_maps.map_image import Bytes, jpeg_notes, read_pixels
from world_maps.map_server import read_header, YAML_LIMIT

IMAGES: Final = ('.png', '.pgm', '.bmp', '.jpg', '.jpeg', '.pnm', '.ppm', '.pbm')

#: Darker than half is a wall.
_DARK: Final = 128
#: All that map savers write: occupied, unknown, free; and white.
_SAVED: Final = (0, SAVED_UNKNOWN, 254, 255)


def header_beside(image: Path) -> Path | None:
    """
    Return the YAML file of map_server beside a file, that names it as its image; None without one.

    Raises
    ------
    WorldError
        If there is one that cannot be read.

    """
    for path in (image.with_suffix('.yaml'), image.with_suffix('.yml')):
        if path.is_file() and b'image' in read_bytes(path, YAML_LIMIT):
            return path if read_header(path).image.name == image.name else None
    return None


def read_image(path: Path, resolution: float | None) -> MapFile:
    """
    Read an image alone: what is darker than half is a wall, and what shines through is white.

    Parameters
    ----------
    path : Path
    resolution : float or None, [m]
        Side of a pixel; the lower left corner of the image is at (0, 0).

    Raises
    ------
    WorldError
        If the file is no image, or ``resolution`` is None.

    """
    if resolution is None:
        raise WorldError(path, 'an image does not say how large it is: give resolution, the '
                               'metres of a pixel (0.05 for instance), or put a .yaml file of '
                               'map_server beside it')
    pixels = read_pixels(path)
    notes = jpeg_notes(path, pixels.kind)
    walls = _as_on_white(pixels.grey, pixels.alpha) < _DARK
    unknown = pixels.grey == SAVED_UNKNOWN
    if unknown.any() and np.isin(pixels.grey, _SAVED).all():
        walls |= unknown
        notes.append(f'{path}: {int(unknown.sum())} of {walls.size} pixels are of the grey '
                     f'{SAVED_UNKNOWN} that map savers write for unknown, they count as blocked')
    occupancy = np.where(walls[::-1], BLOCKED, FREE).astype(np.int8)
    return MapFile(occupancy, resolution, notes=tuple(notes))


def _as_on_white(grey: Bytes, alpha: Bytes) -> Bytes:
    opaque = alpha.astype(np.uint16)
    return ((grey * opaque + 255 * (255 - opaque)) // 255).astype(np.uint8)
