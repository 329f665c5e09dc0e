"""Maps of the MovingAI benchmarks (https://movingai.com/benchmarks/formats.html)."""

from pathlib import Path
import re
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import MOST_CELLS
from control_field.local_grid import BLOCKED, FREE
from world_maps.errors import check_size, read_bytes, WorldError

_FREE: Final = b'.GS'
_BLOCKED: Final = b'@OTW'
#: Four header lines, and line ends of one or two bytes for at most 100000 lines.
_LIMIT: Final = MOST_CELLS + 300_000
_HEADER: Final = re.compile(rb'(type|height|width)[ \t]+(\w{1,16})[ \t]*')


def read_moving_ai(path: Path) -> npt.NDArray[np.int8]:
    """
    Read a MovingAI ``.map``.

    Returns
    -------
    ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked; row 0 at the lowest y, which is the last line of the file.

    Raises
    ------
    WorldError
        If the file is not what its header says.

    """
    lines = read_bytes(path, _LIMIT).replace(b'\r\n', b'\n').rstrip().split(b'\n')
    n_rows, n_cols = _size_from_header(path, lines[:4])
    rows = [line.rstrip() for line in lines[4:]]
    if len(rows) != n_rows:
        raise WorldError(path, f'has {len(rows)} map lines, its header says height {n_rows}')
    for number, row in enumerate(rows, start=5):
        _check_row(path, number, row, n_cols)
    table = np.full(256, BLOCKED, dtype=np.int8)
    table[list(_FREE)] = FREE
    cells = np.frombuffer(b''.join(rows), dtype=np.uint8).reshape(n_rows, n_cols)
    return np.ascontiguousarray(table[cells][::-1])


def _size_from_header(path: Path, header: list[bytes]) -> tuple[int, int]:
    matches = [_HEADER.fullmatch(line) for line in header[:3]]
    found = {match[1]: match[2] for match in matches if match}
    if len(header) < 4 or header[3].strip() != b'map' or found.get(b'type') != b'octile':
        raise WorldError(path, 'is no MovingAI map: it must begin with the lines "type octile", '
                               '"height H", "width W", "map"')
    size = [found.get(name, b'') for name in (b'height', b'width')]
    if not all(re.fullmatch(rb'[0-9]{1,9}', text) for text in size):
        raise WorldError(path, 'height and width in its header must be whole numbers')
    n_rows, n_cols = (int(text) for text in size)
    check_size(path, n_rows, n_cols)
    return n_rows, n_cols


def _check_row(path: Path, number: int, row: bytes, n_cols: int) -> None:
    if len(row) != n_cols:
        raise WorldError(
            path, f'line {number} has {len(row)} cells, its header says width {n_cols}')
    strange = row.translate(None, _FREE + _BLOCKED)
    if strange:
        raise WorldError(path, f'line {number} holds {chr(strange[0])!r}, cells are one of '
                               f'{(_FREE + _BLOCKED).decode()}')
