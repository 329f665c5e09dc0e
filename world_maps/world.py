"""The true world of a simulation: which cells are blocked, and the files it is kept in."""

from dataclasses import dataclass, replace
from functools import cached_property
import math
import os
from pathlib import Path
import sys

import numpy as np
import numpy.typing as npt

from control_field.grid import cell_side, CLEARANCE, Grid
from control_field.local_grid import FREE
from world_maps.errors import WorldError
from world_maps.image_alone import header_beside, IMAGES, read_image
from world_maps.map_file import MapFile
from world_maps.map_server import read_map_server
from world_maps.moving_ai import read_moving_ai
from world_maps.raster import Raster
from world_maps.robot_cells import robot_cells, robot_grid, ROBOT_RADIUS

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
    drawn : Raster, optional
        The pixels of its map, where these are not the cells. The cells are made of them by
        `world_maps.robot_cells`.
    robot_radius : float, [m]
        Of the robot that its cells were made for.

    Raises
    ------
    ValueError
        If the shape disagrees with the grid, or a cell is neither free nor blocked.

    """

    grid: Grid
    occupancy: npt.NDArray[np.int8]
    name: str = 'world'
    notes: tuple[str, ...] = ()
    drawn: Raster | None = None
    robot_radius: float = ROBOT_RADIUS

    def __post_init__(self) -> None:
        """Check the cells and lock them."""
        object.__setattr__(self, 'occupancy', Raster(self.grid, self.occupancy).occupancy)

    @cached_property
    def pixels(self) -> Raster:
        """Return what stands where as exactly as the map says it; the cells, if these are it."""
        return self.drawn or Raster(self.grid, self.occupancy)

    @property
    def size(self) -> str:
        """Say how large it is, in cells and in pixels."""
        if self.drawn is None:
            return self.grid.size
        rows, cols = self.drawn.grid.shape
        return (f'{self.grid.size}, of {rows} x {cols} pixels of '
                f'{self.drawn.grid.resolution:g} m')

    def with_pixels(self, occupancy: npt.NDArray[np.int8]) -> 'World':
        """Return the world with other pixels, and the cells that they make."""
        if self.drawn is None:
            return replace(self, occupancy=occupancy)
        drawn = Raster(self.drawn.grid, occupancy)
        return replace(self, drawn=drawn,
                       occupancy=robot_cells(drawn, self.grid, self.robot_radius))

    def is_blocked(self, row: int, col: int) -> bool:
        """Return whether a cell is blocked; cells outside the workspace are."""
        return not self.grid.contains(row, col) or bool(self.occupancy[row, col] != FREE)


def load_world(
    path: str | Path, frame_id: str = 'odom', robot_radius: float = ROBOT_RADIUS,
    resolution: float | None = None,
) -> World:
    """
    Read a world from a file.

    A pixel that holds the robot's disc is a cell. Of smaller ones cells are made for the robot, on
    the lattice of which (0, 0) is the centre of a cell.

    Parameters
    ----------
    path : str or Path
        A map_server ``.yaml`` (with its image), a MovingAI ``.map`` (1 m a pixel, lower left
        corner at (0, 0)), or an image alone.
    frame_id : str
        The frame its coordinates are given in.
    robot_radius : float, [m]
    resolution : float, optional, [m]
        Side of the cells. Of an image alone, which says nothing of its scale: the side of a
        pixel, which it needs.

    Raises
    ------
    WorldError
        If it is missing or malformed; one line that names the file and what to do.

    """
    path = Path(path)
    drawn, notes = load_pixels(path, frame_id, resolution)
    try:
        return _world_of(drawn, path.stem, notes, robot_radius,
                         None if _says_no_scale(path) else resolution)
    except ValueError as error:
        raise WorldError(path, str(error)) from error


def load_pixels(
    path: Path, frame_id: str, resolution: float | None = None,
) -> tuple[Raster, tuple[str, ...]]:
    """
    Read the pixels of a world from a file.

    Parameters
    ----------
    path : Path
    frame_id : str
    resolution : float, optional, [m]
        Side of a pixel of an image alone; not looked at for any other file.

    Returns
    -------
    pixels : Raster
    notes : tuple of str
        What a user should know of the file, a sentence each.

    Raises
    ------
    WorldError
        If it is missing or malformed.

    """
    try:
        found = _read(path, resolution)
        n_rows, n_cols = found.occupancy.shape
        grid = Grid(n_rows, n_cols, found.resolution, *found.corner, frame_id)
        return Raster(grid, found.occupancy), found.notes
    except MemoryError as error:
        raise WorldError(path, 'is too large for the memory of this machine') from error
    except WorldError:
        raise
    except ValueError as error:
        raise WorldError(path, str(error)) from error


def _read(path: Path, resolution: float | None) -> MapFile:
    if path.suffix.lower() == '.map':
        return MapFile(read_moving_ai(path), 1.0)
    if path.suffix.lower() in ('.yaml', '.yml'):
        return read_map_server(path)
    if _says_no_scale(path):
        return read_image(path, resolution)
    header = header_beside(path)
    if header is None:
        raise WorldError(path, 'a world is a .yaml file of map_server, an image, or a .map file '
                               'of MovingAI')
    found = read_map_server(header)
    note = f'{path}: is read as {header.name} beside it says'
    return replace(found, notes=(note, *found.notes))


def _says_no_scale(path: Path) -> bool:
    """Return whether a file is an image alone: then resolution is the side of a pixel."""
    return path.suffix.lower() in IMAGES and header_beside(path) is None


def _world_of(
    drawn: Raster, name: str, notes: tuple[str, ...], radius: float, resolution: float | None,
) -> World:
    """Return the world of pixels, whose cells are those, or are made for a robot."""
    side = drawn.grid.resolution
    holds_it = side >= 2.0 * radius
    wanted = resolution or (side if holds_it else cell_side(radius))
    is_pixel = math.isclose(wanted, side, rel_tol=1e-9)
    if is_pixel and holds_it:
        return World(drawn.grid, drawn.occupancy, name, notes, robot_radius=radius)
    grid = drawn.grid if is_pixel else robot_grid(drawn.grid, wanted)
    if wanted < radius + CLEARANCE:
        note = (f'{name}: in cells of {wanted:g} m the collision monitor holds a robot of radius '
                f'{radius:g} m, which it does not see around: take cells of '
                f'{math.ceil((radius + CLEARANCE) / 0.01) * 0.01:g} m or more')
        notes = (*notes, note)
    return World(grid, robot_cells(drawn, grid, radius), name, notes, drawn, radius)


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
    occupancy, grid = world.pixels.occupancy, world.pixels.grid
    pixels = np.where(occupancy[::-1] == FREE, 254, 0).astype(np.uint8)
    rows, cols = pixels.shape
    image.write_bytes(b'P5\n%d %d\n255\n' % (cols, rows) + pixels.tobytes())
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
    return config_file(name, 'worlds', ('.yaml', '.yml', '.map', *IMAGES))


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
    if path.suffix.lower() in suffixes or os.sep in name:
        return path
    folders = config_folders(folder)
    for where in folders:
        if (where / f'{name}.yaml').is_file():
            return where / f'{name}.yaml'
    known = sorted({file.stem for where in folders for file in where.glob('*.yaml')})
    kinds = ' or '.join(suffix for suffix in suffixes[:4] if suffix != '.yml')
    raise WorldError(path, f'there is no file of that name in config/{folder}, give the path of a '
                           f'{kinds} file or one of: {", ".join(known) or "(none installed)"}')


def config_folders(name: str) -> list[Path]:
    """Return the folders of a name in ``config``: beside the sources, else in ament prefixes."""
    prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) + [sys.prefix]
    beside = Path(__file__).resolve().parent.parent / 'config' / name
    shares = [Path(prefix) / 'share' / _PACKAGE / 'config' / name
              for prefix in prefixes if prefix]
    return [folder for folder in (beside, *shares) if folder.is_dir()]
