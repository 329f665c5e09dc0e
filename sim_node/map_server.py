"""Maps of ROS's map_server: a YAML file beside an image."""

from collections.abc import Mapping
from dataclasses import dataclass
import os
from pathlib import Path
import re
from typing import Any, BinaryIO, Final, TypeAlias
import warnings

import numpy as np
import numpy.typing as npt
from PIL import Image
import yaml  # type: ignore[import-untyped, unused-ignore]

from control_field.sight import BLOCKED, FREE
from sim_node.map_error import check_size, open_map, read_bytes, WorldError

_YAML_LIMIT: Final = 64 * 1024
_FORMATS: Final = ('PPM', 'PNG', 'BMP')  # Pillow calls PGM 'PPM'
#: How far behind the pixels is looked for something other than blanks.
_MAX_TAIL: Final = 1024
_BLANKS: Final = np.frombuffer(b' \t\n\r\v\f', np.uint8)
_MODES: Final = ('trinary', 'scale', 'raw')
#: What Pillow raises for broken files, beside its own errors (which are OSErrors).
_BROKEN: Final = (OSError, ValueError, SyntaxError, EOFError, OverflowError, TypeError,
                  MemoryError, Image.DecompressionBombError, Warning)


Shades: TypeAlias = npt.NDArray[np.float32]


@dataclass(frozen=True)
class MapHeader:
    """What the YAML file says; see map_server's documentation."""

    image: Path
    resolution: float
    origin_x: float
    origin_y: float
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str


def read_map_server(path: Path) -> tuple[MapHeader, npt.NDArray[np.int8]]:
    """
    Read a map_server YAML file and its image.

    Returns
    -------
    header : MapHeader
        What the YAML file says.
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked; row 0 at the lowest y. Cells whose state is unknown are blocked: in
        a true world there is no third kind.

    Raises
    ------
    WorldError
        If one of the two is missing or malformed.

    """
    header = read_header(path)
    shade, opaque = read_shades(header.image)
    return header, _occupancy(header, shade, opaque)


def read_header(path: Path) -> MapHeader:
    """
    Read and check the YAML file alone.

    Raises
    ------
    WorldError
        If a field is missing, of the wrong type or out of range.

    """
    fields = _fields(path)
    image = fields.get('image')
    if not isinstance(image, str) or not image or '\0' in image:
        raise WorldError(path, 'image must be the name of a PGM or PNG file')
    mode = str(fields.get('mode', 'trinary')).lower()
    if mode not in _MODES:
        raise WorldError(path, f'mode must be one of {", ".join(_MODES)}')
    origin_x, origin_y = _origin(path, fields)
    header = MapHeader(
        path.parent / image, _number(path, fields, 'resolution', None, 1e-6, 1e6),
        origin_x, origin_y, _negate(path, fields),
        _number(path, fields, 'occupied_thresh', 0.65, 0, 1),
        _number(path, fields, 'free_thresh', 0.25, 0, 1), mode)
    if header.free_thresh > header.occupied_thresh:
        raise WorldError(path, f'free_thresh {header.free_thresh} is above occupied_thresh '
                               f'{header.occupied_thresh}')
    return header


def read_shades(path: Path) -> tuple[Shades, Shades]:
    """
    Read how bright and how opaque each pixel of an image is.

    Returns
    -------
    shade, opaque : ndarray, shape (n_rows, n_cols)
        0 to 1; first row at the top of the image.

    Raises
    ------
    WorldError
        If the file is no image, is cut off or longer than its header says.

    """
    with open_map(path) as file:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter('error')
                with Image.open(file, formats=_FORMATS) as image:
                    check_size(path, image.height, image.width)
                    _check_length(path, file, image)
                    return _shades_from_image(path, image)
        except WorldError:
            raise
        except _BROKEN as error:
            raise WorldError(path, 'is no complete PGM or PNG image, write it anew') from error


def _check_length(path: Path, file: BinaryIO, image: Image.Image) -> None:
    """Refuse a PGM with more or fewer pixels than its header says."""
    file.seek(0)
    kind = file.read(2)
    if kind == b'P2':
        _check_numbers(path, file.read(), image.width * image.height)
    if kind != b'P5':
        return
    first = getattr(image, 'tile')[0][2]  # noqa: B009 - Pillow's types do not know it
    n_bytes = image.width * image.height * (1 if image.mode == 'L' else 2)
    n_there = file.seek(0, os.SEEK_END) - first
    file.seek(first + n_bytes)
    if n_there < n_bytes or file.read(_MAX_TAIL).strip():
        raise WorldError(path, f'holds {n_there} bytes of pixels, its header says '
                               f'{image.width} x {image.height}: {n_bytes}')


def _check_numbers(path: Path, text: bytes, n_pixels: int) -> None:
    """Refuse a PGM in plain text with more or fewer numbers than pixels."""
    is_blank = np.isin(np.frombuffer(re.sub(rb'#[^\r\n]*', b'', text), np.uint8), _BLANKS)
    # Width, height and the value of white stand before the pixels.
    n_there = int((is_blank[:-1] & ~is_blank[1:]).sum()) - 3
    if n_there != n_pixels:
        raise WorldError(path, f'holds {n_there} pixels, its header says {n_pixels}')


def _shades_from_image(path: Path, image: Image.Image) -> tuple[Shades, Shades]:
    if image.mode == 'F':
        raise WorldError(path, 'has pixels of floating point, save it as 8-bit grey')
    if image.mode in ('L', 'I', 'I;16', 'I;16B'):
        white = 255.0 if image.mode == 'L' else 65535.0
        shade = np.asarray(image).astype(np.float32) / np.float32(white)
        return shade, np.ones_like(shade)
    pixels = np.asarray(image.convert('RGBA'))
    shade = pixels[:, :, :3].mean(axis=2, dtype=np.float32) / np.float32(255.0)
    return shade, pixels[:, :, 3].astype(np.float32) / np.float32(255.0)


def _occupancy(header: MapHeader, shade: Shades, opaque: Shades) -> npt.NDArray[np.int8]:
    """Tell free from blocked as map_server does; only what is surely free is free."""
    if header.mode == 'raw':
        # Pixels are the values of an OccupancyGrid themselves: 0 to 100, unknown above that.
        free = np.rint(shade * 255.0) < 50.0
    else:
        if header.mode == 'trinary':
            # map_server averages opacity in with the colours, but only where there is one.
            shade = (3.0 * shade + opaque) / 4.0 if (opaque < 1.0).any() else shade
        occupied = shade if header.negate else 1.0 - shade
        free = occupied < header.free_thresh
        if header.mode == 'scale':
            middle = (header.free_thresh + header.occupied_thresh) / 2.0
            free = ((occupied < middle) | free) & (opaque >= 1.0)
    return np.ascontiguousarray(np.where(free, FREE, BLOCKED).astype(np.int8)[::-1])


def _fields(path: Path) -> Mapping[str, Any]:
    text = read_bytes(path, _YAML_LIMIT)
    try:
        fields = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        where = f' in line {mark.line + 1}' if mark else ''
        raise WorldError(path, f'is no YAML{where}, see the maps in config/worlds') from error
    except (ValueError, RecursionError, OverflowError) as error:
        raise WorldError(path, 'is no YAML, see the maps in config/worlds') from error
    if not isinstance(fields, dict) or 'image' not in fields:
        raise WorldError(path, 'is no map_server file: it must have image, resolution and origin')
    return fields


def _origin(path: Path, fields: Mapping[str, Any]) -> tuple[float, float]:
    origin = fields.get('origin')
    if not isinstance(origin, list) or len(origin) != 3:
        raise WorldError(path, 'origin must be [x, y, yaw]')
    places = dict(zip(('x', 'y', 'yaw'), origin, strict=False))
    x, y = (_number(path, places, name, None, -1e7, 1e7) for name in ('x', 'y'))
    if _number(path, places, 'yaw', 0.0, -1e7, 1e7) != 0.0:
        raise WorldError(path, 'the yaw of origin must be 0: cells are parallel to the axes')
    return x, y


def _negate(path: Path, fields: Mapping[str, Any]) -> bool:
    value = fields.get('negate', 0)
    if value not in (0, 1):  # so are false and true
        raise WorldError(path, 'negate must be 0 or 1')
    return bool(value)


def _number(
    path: Path, fields: Mapping[str, Any], name: str, default: float | None, low: float,
    high: float,
) -> float:
    value = fields.get(name, default)
    if isinstance(value, str):  # YAML 1.1 reads 1e-2 as a word, map_server as a number
        value = _float_or_none(value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not low <= value <= high:  # NaN is in no range
        raise WorldError(path, f'{name} must be a number between {low:g} and {high:g}')
    return float(value)


def _float_or_none(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
