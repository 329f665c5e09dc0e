"""What a browser sends as a world: drawn cells, an image, or the two files of map_server."""

from collections.abc import Mapping
import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE
from msgs_bridge.untrusted.yaml_texts import text_from_yaml, yaml_from_text
from page_node.refusal import RefusedError
from world_maps.errors import WorldError
from world_maps.raster import Raster
from world_maps.world import load_pixels

#: Longest side, [pixels].
MOST_PIXELS: Final = 4096
#: Longest JSON header of a frame, [bytes].
MOST_HEADER: Final = 65_536
#: Greatest side of a pixel, and smallest, [m].
_SIDES: Final = (0.005, 10.0)
#: Farthest corner, [m].
_FAR: Final = 1e6
_FRAME_ID: Final = 'odom'

Bytes = npt.NDArray[np.uint8]


def pixels_from_upload(
    body: bytes, media_type: str, query: Mapping[str, str],
) -> tuple[Raster, tuple[str, ...]]:
    """
    Return the pixels of a world that was sent.

    Parameters
    ----------
    body : bytes
        An image, or a big frame of type ``drawn`` (`resolution`, `origin`, array `cells`),
        ``image`` (`resolution`, array `image`) or ``map_server`` (`yaml`, array `image`).
    media_type : str
        ``image/...`` for an image by itself.
    query : mapping
        With it: `resolution`, the metres of a pixel.

    Returns
    -------
    pixels : Raster
    notes : tuple of str
        What a person should know of it.

    Raises
    ------
    RefusedError
        If it is none of these, or too large.

    """
    if media_type.startswith('image/'):
        return _from_image(body, _side(query.get('resolution')))
    header, arrays = read_frame(body)
    kind = header.get('type')
    if kind == 'drawn':
        return _from_cells(header, arrays.get('cells')), ()
    image = arrays.get('image')
    if image is None or kind not in ('image', 'map_server'):
        raise _malformed('a world is a frame of type drawn, image or map_server with its array')
    if kind == 'image':
        return _from_image(image.tobytes(), _side(header.get('resolution')))
    return _from_map_server(header.get('yaml'), image.tobytes())


def read_frame(body: bytes) -> tuple[dict[str, Any], dict[str, Bytes]]:
    """
    Read a big frame (`page_node.big_frames`) that holds bytes, from who may send anything.

    Raises
    ------
    RefusedError
        If it is none.

    """
    length = int.from_bytes(body[:4], 'little')
    if not 2 <= length <= min(MOST_HEADER, len(body) - 4):
        raise _malformed('this is no frame')
    try:
        header = json.loads(body[4:4 + length])
        columns = [(str(each['name']), each['dtype'], tuple(map(_size, each['shape'])))
                   for each in header.pop('arrays')]
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise _malformed('the header of the frame is none') from None
    arrays, offset = {}, 4 + length
    for name, dtype, shape in columns:
        n_bytes = math.prod(shape)
        if dtype != 'u1' or len(shape) not in (1, 2) or offset + n_bytes > len(body):
            raise _malformed(f'the array {name[:40]!r} is none of bytes, or is not whole')
        arrays[name] = np.frombuffer(body, np.uint8, n_bytes, offset).reshape(shape)
        offset += n_bytes
    if offset != len(body):
        raise _malformed('there is more in the frame than its header says')
    return header, arrays


def _size(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 < value < 2**31:
        raise ValueError('an array has a side of no length')
    return value


def _from_cells(header: Mapping[str, Any], cells: Bytes | None) -> Raster:
    if cells is None or cells.ndim != 2:
        raise _malformed('cells is an array of rows and columns')
    _check_sides(cells.shape)
    origin = header.get('origin', [0.0, 0.0])
    if not isinstance(origin, list) or len(origin) != 2 or not all(map(_is_place, origin)):
        raise _malformed('origin is the place of the lower left corner, [x, y] in metres')
    n_rows, n_cols = cells.shape
    x, y = map(float, origin)
    grid = Grid(n_rows, n_cols, _side(header.get('resolution')), x, y, _FRAME_ID)
    return Raster(grid, np.where(cells == 0, FREE, BLOCKED).astype(np.int8))


def _from_image(image: bytes, side: float) -> tuple[Raster, tuple[str, ...]]:
    with TemporaryDirectory(prefix='world-') as folder:
        path = Path(folder) / 'image.png'  # the content says which format it is
        path.write_bytes(image)
        return _load(path, side)


def _from_map_server(text: Any, image: bytes) -> tuple[Raster, tuple[str, ...]]:
    """Read both files as map_server does, whatever the image is called in the YAML file."""
    if not isinstance(text, str) or len(text) > MOST_HEADER:
        raise _malformed('yaml is the text of the file')
    try:
        fields = yaml_from_text(text, as_written=True)
    except ValueError as error:
        raise RefusedError('unreadable', f'the YAML file: {error}', 400) from None
    if not isinstance(fields, dict):
        raise RefusedError('unreadable', 'the YAML file is none of map_server', 400)
    with TemporaryDirectory(prefix='world-') as folder:
        (Path(folder) / 'image').write_bytes(image)
        path = Path(folder) / 'map.yaml'
        path.write_text(text_from_yaml({**fields, 'image': 'image'}))
        return _load(path)


def _load(path: Path, side: float | None = None) -> tuple[Raster, tuple[str, ...]]:
    try:
        pixels, notes = load_pixels(path, _FRAME_ID, side)
    except WorldError as error:
        raise RefusedError('unreadable', error.problem, 400) from None
    _check_sides(pixels.grid.shape)
    return pixels, tuple(note.replace(f'{path.parent}/', '') for note in notes)


def _check_sides(shape: tuple[int, ...]) -> None:
    if max(shape) > MOST_PIXELS:
        raise RefusedError('too_large', f'{shape[1]} x {shape[0]} pixels are too many, at most '
                           f'{MOST_PIXELS} a side: make the image smaller', 413)


def _side(value: Any) -> float:
    try:
        side = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        side = math.nan
    if not _SIDES[0] <= side <= _SIDES[1]:
        raise RefusedError('no_resolution', f'resolution is the side of a pixel in metres, '
                           f'{_SIDES[0]:g} to {_SIDES[1]:g}', 400)
    return side


def _is_place(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= _FAR


def _malformed(message: str) -> RefusedError:
    return RefusedError('malformed', message, 400)
