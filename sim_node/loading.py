"""From parameters to the world of the robot, and to the picture of it that is published."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from sim_node.settings import SimSettings
from sim_node.start import start_in
from world_maps.movers_file import find_movers, load_movers, Script
from world_maps.raster import Raster
from world_maps.world import find_world, load_world, World

#: Parameters that a world is made by.
_MAKE_WORLD: Final = ('world', 'movers', 'robot_radius', 'resolution')
#: A picture for eyes has no more pixels: a message of 4 MiB.
_MOST_SHOWN: Final = 2**22


class Loaded(NamedTuple):
    """
    A world, what happens in it, and where the robot starts.

    Parameters
    ----------
    world : World
    script : Script
    settings : SimSettings
        With a start at which the robot can stand.
    notes : list of str
        What a user should know of the files and of the start, a sentence each.

    """

    world: World
    script: Script
    settings: SimSettings
    notes: list[str]


def load(settings: SimSettings) -> Loaded:
    """
    Read the world of the robot.

    Raises
    ------
    WorldError
        If a file is missing or malformed.

    """
    world = load_world(find_world(settings.world), settings.frame_id, settings.robot_radius,
                       settings.resolution or None)
    script = load_movers(find_movers(settings.movers), world) if settings.movers else Script()
    settings, note = start_in(world, settings)
    return Loaded(world, script, settings, [*world.notes, *([note] if note else [])])


def load_anew(settings: SimSettings, named: Mapping[str, Any], world: World) -> Loaded | None:
    """
    Read the world that other parameters make; None if it is the same.

    Parameters
    ----------
    settings : SimSettings
        So far.
    named : mapping of str
        Parameters that become others.
    world : World
        So far.

    Raises
    ------
    ValueError
        If a parameter is out of range, or a file missing or malformed.

    """
    # What is of another type stays so: the settings say what is wrong with it.
    makers: dict[str, Any] = {
        name: float(value) if isinstance(value, int) else value
        for name, value in named.items() if name in _MAKE_WORLD}
    if not makers:
        return None
    loaded = load(replace(settings, **makers))
    is_same = loaded.world.drawn is None and loaded.world.grid == world.grid
    return None if is_same and not makers.keys() & {'world', 'movers'} else loaded


def picture_of(pixels: Raster) -> tuple[npt.NDArray[np.int8], Grid]:
    """
    Return what is shown of a world: its pixels, or if these are too many, larger ones.

    Returns
    -------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        Blocked where one of the pixels is.
    grid : Grid

    """
    grid, cells = pixels.grid, pixels.occupancy
    k = int(np.ceil(np.sqrt(cells.size / _MOST_SHOWN)))
    if k == 1:
        return cells, grid
    rows, cols = (-(-n // k) for n in cells.shape)
    padded = np.zeros((rows * k, cols * k), dtype=np.int8)
    padded[:cells.shape[0], :cells.shape[1]] = cells
    return (padded.reshape(rows, k, cols, k).max(axis=(1, 3)),
            Grid(rows, cols, grid.resolution * k, grid.origin_x, grid.origin_y, grid.frame_id))
