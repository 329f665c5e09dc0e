"""Maps of ROS's map_server: a YAML file beside an image."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from pathlib import Path, PureWindowsPath
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.local_grid import BLOCKED, FREE
from control_field.words import counted
from msgs_bridge.untrusted.yaml_texts import yaml_from_text
from world_maps.errors import read_bytes, WorldError
from world_maps.map_cells import (
    cells_from_pixels, MODES, n_saved_unknown_free, SAVED_UNKNOWN, turned, turned_corner, UNKNOWN)
from world_maps.map_file import MapFile
from world_maps.map_image import jpeg_notes, Pixels, read_pixels

YAML_LIMIT: Final = 64 * 1024
#: What ROS 1's saver wrote; the map_server of today refuses a file without them.
_OCCUPIED_THRESH: Final = 0.65
_FREE_THRESH: Final = 0.196
#: What map_server takes for `negate`.
_BOOLEANS: Final = {'1': True, '0': False, 'y': True, 'yes': True, 'true': True, 'on': True,
                    'n': False, 'no': False, 'false': False, 'off': False}
#: Cells of less than half occupied are free to drive on (modes scale and raw).
_HALF: Final = 50
#: 3.14 and 1.57 mean half and quarter turns [rad].
_ANGLE_TOLERANCE: Final = 0.005


@dataclass(frozen=True)
class MapHeader:
    """What the YAML file says; see map_server's documentation."""

    image: Path
    resolution: float
    origin_x: float
    origin_y: float
    #: Quarter turns counter-clockwise about the origin, 0 to 3.
    quarters: int
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str
    #: What was guessed or made do with, for the user.
    notes: tuple[str, ...] = ()


def read_map_server(path: Path) -> MapFile:
    """
    Read a map_server YAML file and its image.

    Raises
    ------
    WorldError
        If one of the two is missing or malformed.

    """
    header = read_header(path)
    pixels = read_pixels(header.image)
    cells = cells_from_pixels(pixels, header.mode, header.negate, header.occupied_thresh,
                              header.free_thresh)
    corner = turned_corner((header.origin_x, header.origin_y), (cells.shape[0], cells.shape[1]),
                           header.resolution, header.quarters)
    free = (cells > UNKNOWN) & (cells < _HALF)
    occupancy = turned(np.where(free, FREE, BLOCKED).astype(np.int8), header.quarters)
    return MapFile(occupancy, header.resolution, corner,
                   (*header.notes, *_notes(header, pixels, cells)))


def _notes(header: MapHeader, pixels: Pixels, cells: npt.NDArray[np.int8]) -> list[str]:
    """Return what a user should know of the image and of its cells."""
    image = header.image
    notes = jpeg_notes(image, pixels.kind)
    n_free = n_saved_unknown_free(pixels, cells) if header.mode == 'trinary' else 0
    if n_free:
        notes.append(
            f'{image}: {counted(n_free, "cell")} that may be unknown count as free: Nav2 saves '
            f'unknown as grey {SAVED_UNKNOWN}, and free_thresh is {header.free_thresh:g}; with '
            f'"free_thresh: {_FREE_THRESH:g}" they are unknown')
    n_unknown = int((cells == UNKNOWN).sum())
    if n_unknown:
        notes.append(f'{image}: {n_unknown} of {cells.size} cells are unknown, they count as '
                     f'blocked')
    return notes


def read_header(path: Path) -> MapHeader:
    """
    Read and check the YAML file alone.

    Raises
    ------
    WorldError
        If a field is missing, of the wrong type or out of range.

    """
    fields = _fields(path)
    image, notes = _image(path, fields)
    mode = fields.get('mode', 'trinary')
    if not isinstance(mode, str) or mode.lower() not in MODES:
        raise WorldError(path, f'mode must be one of {", ".join(MODES)}')
    x, y, yaw = _origin(path, fields)
    header = MapHeader(
        image, _number(path, fields, 'resolution', None, 1e-6, 1e6), x, y,
        _quarters(path, yaw), _negate(path, fields),
        _number(path, fields, 'occupied_thresh', _OCCUPIED_THRESH, 0, 1),
        _number(path, fields, 'free_thresh', _FREE_THRESH, 0, 1), mode.lower(),
        (*notes, *_guesses(path, fields, yaw)))
    if header.free_thresh > header.occupied_thresh:
        raise WorldError(path, f'free_thresh {header.free_thresh} is above occupied_thresh '
                               f'{header.occupied_thresh}')
    return header


def _guesses(path: Path, fields: Mapping[str, Any], yaw: float) -> list[str]:
    """Return what the file leaves open or says only nearly."""
    defaults = {'occupied_thresh': _OCCUPIED_THRESH, 'free_thresh': _FREE_THRESH, 'negate': 0}
    absent = [f'{name}: {value:g}' for name, value in defaults.items() if name not in fields]
    notes = []
    if absent:
        notes.append(f'{path}: says nothing of {", ".join(absent)}, which is taken so (map_server '
                     f'would refuse the file)')
    degrees = 90 * _quarters(path, yaw)
    if degrees:
        notes.append(f'{path}: its origin is turned by {yaw:g} rad: the map is read turned by '
                     f'{degrees} degrees')
    return notes


def _image(path: Path, fields: Mapping[str, Any]) -> tuple[Path, list[str]]:
    """Return where the image is: where the YAML file says, else of that name beside the file."""
    image = fields.get('image')
    if not isinstance(image, str) or not image or '\0' in image:
        raise WorldError(path, 'image must be the name of a PGM or PNG file')
    named = path.parent / image
    beside = path.parent / PureWindowsPath(image).name  # takes both kinds of slashes
    if _is_there(named):
        return named, []
    if beside != named and _is_there(beside):
        note = (f'{path}: its image {image} is not there, {beside.name} beside the YAML file is '
                f'read instead')
        return beside, [note]
    also = ', nor one of that name' if beside != named else ''
    raise WorldError(path, f'says image: {image}, but there is no such file{also} beside the YAML '
                           f'file: put the image there or mend that line')


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a name that is too long, a folder that is closed
        return False


def _fields(path: Path) -> Mapping[str, Any]:
    text = read_bytes(path, YAML_LIMIT)
    try:
        fields = yaml_from_text(text, as_written=True)
    except ValueError as error:
        raise WorldError(path, f'{error}, see the maps in config/worlds') from error
    if not isinstance(fields, dict) or 'image' not in fields:
        raise WorldError(path, 'is no map_server file: it must have image, resolution and origin')
    return fields


def _origin(path: Path, fields: Mapping[str, Any]) -> tuple[float, float, float]:
    origin = fields.get('origin')
    if not isinstance(origin, list) or len(origin) != 3:
        raise WorldError(path, 'origin must be [x, y, yaw]')
    places = dict(zip(('x', 'y', 'yaw'), origin, strict=True))
    x, y, yaw = (_number(path, places, name, None, -1e7, 1e7) for name in places)
    return x, y, yaw


def _quarters(path: Path, yaw: float) -> int:
    """Return the quarter turns of an angle, 0 to 3."""
    quarters = round(yaw / (math.pi / 2))
    if abs(yaw - quarters * math.pi / 2) > _ANGLE_TOLERANCE:
        degrees = ' (is it meant in degrees?)' if abs(yaw) > 2 * math.pi else ''
        raise WorldError(
            path, f'the yaw of its origin is {yaw:g} rad, {math.degrees(yaw):.6g} degrees'
                  f'{degrees}: only maps turned by 0, 90, 180 or 270 degrees can be read, save '
                  f'the map straight')
    return quarters % 4


def _negate(path: Path, fields: Mapping[str, Any]) -> bool:
    value = fields.get('negate', '0')
    if not isinstance(value, str) or value.lower() not in _BOOLEANS:
        raise WorldError(path, 'negate must be 0 or 1')
    return _BOOLEANS[value.lower()]


def _number(
    path: Path, fields: Mapping[str, Any], name: str, default: float | None, low: float,
    high: float,
) -> float:
    value = _float_or_none(fields[name]) if name in fields else default
    if value is None or not low <= value <= high:  # NaN is in no range
        raise WorldError(path, f'{name} must be a number between {low:g} and {high:g}')
    return value


def _float_or_none(text: Any) -> float | None:
    try:
        # Python alone takes 1_000.
        return float(text) if isinstance(text, str) and '_' not in text else None
    except ValueError:
        return None
