"""Reading and writing worlds: what the working process does for the room."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from page_node.big_frames import bytes_from_frame
from page_node.refusal import RefusedError
from page_node.worlds.folder import check_name, MOST_WORLDS, shipped, WorldsFolder
from page_node.worlds.uploads import MOST_PIXELS, pixels_from_upload
from world_maps.errors import WorldError
from world_maps.raster import Raster
from world_maps.world import load_pixels, save_world, World


def list_of(folder: str) -> list[dict[str, Any]]:
    """Return which worlds there are: `name`, whether it is `own`, when it was `changed`."""
    return [{'name': world.name, 'own': world.is_own, 'changed': _changed(world.path)}
            for world in WorldsFolder(folder).all()]


def _changed(path: Path) -> int:
    """Return a number that is another one after each change."""
    try:
        return max(each.stat().st_mtime_ns for each in (path, path.with_suffix('.pgm'))
                   if each.exists()) // 1000
    except (OSError, ValueError):
        return 0


def path_of(folder: str, name: str) -> str:
    """Return what a simulator is told to find a world, which can be read."""
    world = WorldsFolder(folder).find(name)
    _pixels(world.path)
    return str(world.path) if world.is_own else world.name


def frame_of(folder: str, name: str, most: int = MOST_PIXELS) -> bytes:
    """
    Return the pixels of a world as a big frame.

    Parameters
    ----------
    folder : str
    name : str
    most : int
        Longest side of the picture; of a larger one several pixels become one, a wall where one
        of them is.

    Raises
    ------
    RefusedError
        If there is none of that name, or it cannot be read.

    """
    world = WorldsFolder(folder).find(name)
    grid, occupancy = _smaller(_pixels(world.path), most)
    return bytes_from_frame(
        {'type': 'world', 'name': name, 'own': world.is_own, 'rows': grid.n_rows,
         'cols': grid.n_cols, 'resolution': grid.resolution,
         'origin': [grid.origin_x, grid.origin_y]}, {'occupancy': occupancy})


def save(
    folder: str, name: str, body: bytes, media_type: str, query: Mapping[str, str],
) -> dict[str, Any]:
    """
    Keep what was sent as a world: a YAML file of map_server and its image, both our own.

    Returns
    -------
    dict
        `name`, `rows`, `cols`, `resolution`, and `notes`: sentences on what was sent.

    Raises
    ------
    RefusedError
        If it is no world, the name is none or one of ours, there are too many, or nothing can be
        written.

    """
    place = WorldsFolder(folder)
    _check_free(place, name)
    pixels, notes = pixels_from_upload(body, media_type, query)
    _write(place.path, name, pixels)
    grid = pixels.grid
    return {'name': name, 'rows': grid.n_rows, 'cols': grid.n_cols,
            'resolution': grid.resolution, 'notes': list(notes)}


def _check_free(place: WorldsFolder, name: str) -> None:
    if check_name(name) in shipped():
        raise RefusedError('shipped', f'{name} comes with experience_controller and stays as it '
                           f'is: take another name', 409)
    own = [world.name for world in place.own()]
    if name not in own and len(own) >= MOST_WORLDS:
        raise RefusedError('too_many', f'there are {len(own)} worlds in {place.path}: remove some '
                           f'there first', 409)


def _write(folder: Path, name: str, pixels: Raster) -> None:
    """Write both files aside, then put them in their places; links there are replaced."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix='.making-', dir=folder) as aside:
            made = save_world(Path(aside) / f'{name}.yaml', World(
                pixels.grid, pixels.occupancy, name))
            for suffix in ('.pgm', '.yaml'):
                made.with_suffix(suffix).replace(folder / f'{name}{suffix}')
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise RefusedError('not_written', f'{folder}: cannot save there: {why}', 507) from None


def _pixels(path: Path) -> Raster:
    try:
        return load_pixels(path, 'odom')[0]
    except WorldError as error:
        raise RefusedError('unreadable', str(error), 409) from None


def _smaller(pixels: Raster, most: int) -> tuple[Grid, npt.NDArray[np.int8]]:
    """Return a picture with sides of so many pixels at most."""
    grid, cells = pixels.grid, pixels.occupancy
    k = -(-max(cells.shape) // max(most, 1))
    if k == 1:
        return grid, cells
    rows, cols = (-(-n // k) for n in cells.shape)
    padded = np.zeros((rows * k, cols * k), np.int8)
    padded[:cells.shape[0], :cells.shape[1]] = cells
    small = padded.reshape(rows, k, cols, k).max(axis=(1, 3))
    return Grid(rows, cols, grid.resolution * k, grid.origin_x, grid.origin_y,
                grid.frame_id), small
