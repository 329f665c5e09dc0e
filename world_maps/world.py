"""The true world of a simulation: which cells are blocked, and the files it is kept in."""

from dataclasses import dataclass
import os
from pathlib import Path
import sys

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, FREE
from world_maps.errors import WorldError
from world_maps.map_server import read_map_server
from world_maps.moving_ai import read_moving_ai

__all__ = ['World', 'WorldError', 'find_world', 'load_world', 'save_world']

_PACKAGE = 'experience_controller'
_YAML = """\
image: {image}
mode: trinary
resolution: {resolution!r}
origin: [{x!r}, {y!r}, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


@dataclass(frozen=True, eq=False)
class World:
    """
    A workspace and what stands in it.

    Parameters
    ----------
    grid : Grid
        The workspace; around it are walls.
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked; row 0 at the lowest y. Made read-only.
    name : str
        For messages and tables.
    notes : tuple of str
        What a user should know of the file it was read from, a sentence each.

    Raises
    ------
    ValueError
        If the shape disagrees with the grid, or a cell is neither free nor blocked.

    """

    grid: Grid
    occupancy: npt.NDArray[np.int8]
    name: str = 'world'
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the cells and lock them."""
        cells = np.ascontiguousarray(self.occupancy, dtype=np.int8)
        if cells.shape != self.grid.shape:
            raise ValueError(f'world: occupancy has shape {cells.shape}, must be '
                             f'{self.grid.shape}')
        if not np.isin(cells, (FREE, BLOCKED)).all():
            raise ValueError(f'world: cells must be {FREE} (free) or {BLOCKED} (blocked)')
        if cells is self.occupancy:
            cells = cells.copy()
        cells.setflags(write=False)
        object.__setattr__(self, 'occupancy', cells)

    def is_blocked(self, row: int, col: int) -> bool:
        """Return whether a cell is blocked; cells outside the workspace are."""
        return not self.grid.contains(row, col) or bool(self.occupancy[row, col] != FREE)


def load_world(path: str | Path, frame_id: str = 'odom') -> World:
    """
    Read a world from a file.

    Parameters
    ----------
    path : str or Path
        A map_server ``.yaml`` (with its image) or a MovingAI ``.map`` (1 m a cell, lower left
        corner at (0, 0)).
    frame_id : str
        The frame its coordinates are given in.

    Raises
    ------
    WorldError
        If it is missing or malformed; one line that names the file and what to do.

    """
    path = Path(path)
    notes: tuple[str, ...] = ()
    try:
        if path.suffix == '.map':
            occupancy = read_moving_ai(path)
            resolution, x, y = 1.0, 0.0, 0.0
        elif path.suffix in ('.yaml', '.yml'):
            found = read_map_server(path)
            resolution, occupancy, notes = found.header.resolution, found.occupancy, found.notes
            x, y = found.corner
        else:
            raise WorldError(
                path, 'a world is a .yaml file of map_server (not its image) or a .map file of '
                      'MovingAI')
    except MemoryError as error:
        raise WorldError(path, 'is too large for the memory of this machine') from error
    n_rows, n_cols = occupancy.shape
    try:
        grid = Grid(n_rows, n_cols, resolution, x, y, frame_id)
        return World(grid, occupancy, path.stem, notes)
    except ValueError as error:
        raise WorldError(path, str(error)) from error


def save_world(path: str | Path, world: World) -> Path:
    """
    Write a world as map_server files: ``path`` (``.yaml``) and a binary PGM beside it.

    Returns
    -------
    Path
        The YAML file.

    Raises
    ------
    OSError
        If the folder cannot be written to.

    """
    path = Path(path)
    if path.suffix not in ('.yaml', '.yml'):
        raise WorldError(path, 'a world is written to a .yaml file')
    image = path.with_suffix('.pgm')
    pixels = np.where(world.occupancy[::-1] == FREE, 254, 0).astype(np.uint8)
    rows, cols = pixels.shape
    image.write_bytes(b'P5\n%d %d\n255\n' % (cols, rows) + pixels.tobytes())
    grid = world.grid
    path.write_text(_YAML.format(image=image.name, resolution=float(grid.resolution),
                                 x=float(grid.origin_x), y=float(grid.origin_y)))
    return path


def find_world(name: str) -> Path:
    """
    Return the file of a world that is given by path, or by bare name from ``config/worlds``.

    Raises
    ------
    WorldError
        If there is no world of that bare name; the message lists those that there are.

    """
    return config_file(name, 'worlds', ('.yaml', '.yml', '.map'))


def config_file(name: str, folder: str, suffixes: tuple[str, ...]) -> Path:
    """
    Return a file that is given by path, or by bare name from a folder of ``config``.

    Parameters
    ----------
    name : str
        A path, if it has one of the suffixes or a slash.
    folder : str
    suffixes : tuple of str
        Of the files that can be read.

    Raises
    ------
    WorldError
        If there is none of that bare name; the message lists those that there are.

    """
    path = Path(name)
    if path.suffix in suffixes or os.sep in name:
        return path
    folders = config_folders(folder)
    for where in folders:
        if (where / f'{name}.yaml').is_file():
            return where / f'{name}.yaml'
    known = sorted({file.stem for where in folders for file in where.glob('*.yaml')})
    kinds = ' or '.join(suffix for suffix in suffixes if suffix != '.yml')
    raise WorldError(path, f'there is no file of that name in config/{folder}, give the path of a '
                           f'{kinds} file or one of: {", ".join(known) or "(none installed)"}')


def config_folders(name: str) -> list[Path]:
    """Return the folders of a name in ``config``: beside the sources, else in ament prefixes."""
    prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) + [sys.prefix]
    beside = Path(__file__).resolve().parent.parent / 'config' / name
    shares = [Path(prefix) / 'share' / _PACKAGE / 'config' / name
              for prefix in prefixes if prefix]
    return [folder for folder in (beside, *shares) if folder.is_dir()]
