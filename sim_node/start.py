"""Where the robot starts in a world in which it cannot stand where it should."""

from dataclasses import fields, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import FREE
from sim_node.robot import Placement
from sim_node.settings import SimSettings
from world_maps.clearance import Clearance
from world_maps.world import World

#: The start that is none of the user's.
_DEFAULT: Final = tuple(
    spec.default for spec in fields(SimSettings) if spec.name in ('start_x', 'start_y'))


def start_in(world: World, settings: SimSettings) -> tuple[SimSettings, str]:
    """
    Return where the robot starts: where it should, else in a free cell near by.

    Where nobody has given one it is the cell nearest to the middle of the world, in the largest
    part of it that hangs together. One outside the world that was given is left as it is, for the
    simulation to refuse.

    Returns
    -------
    settings : SimSettings
        With this start.
    note : str
        Why it is another one than was asked for; empty if it is not.

    """
    grid, here = world.grid, (settings.start_x, settings.start_y)
    is_default, cell = here == _DEFAULT, grid.cell_from_world(*here)
    is_inside = grid.contains(*cell)
    if not (is_inside or is_default):
        return settings, ''
    stands = is_inside and Clearance(world, settings.robot_radius).at(*here) >= 0.0
    if stands and not (is_default and world.drawn is not None):
        return settings, ''
    good = np.asarray(world.occupancy == FREE)
    good = largest_part(good) if is_default else good
    if not good.any() or (stands and good[cell]):
        return settings, ''
    x, y = _nearest(good, grid, _middle(world) if is_default else here)
    where = 'nearest to the middle of the world' if is_default else 'nearest to it'
    note = (f'start_x, start_y: ({here[0]:g}, {here[1]:g}) m is no place for the robot in the '
            f'world {world.name}: it starts at ({x:g}, {y:g}) m, in the free cell {where}')
    return replace(settings, start_x=x, start_y=y), note


def place_in(world: World, here: Placement, settings: SimSettings) -> Placement | None:
    """
    Return where a robot goes in a world that it finds around itself.

    Parameters
    ----------
    world : World
    here : Placement
        Where it truly is.
    settings : SimSettings
        With a start at which it can stand.

    Returns
    -------
    Placement or None
        Where it is, if it can stand there; else the nearest cell of the largest part that is
        free, or its start if the world does not reach to where it is. None if nothing is free.

    """
    radius, grid = settings.robot_radius, world.grid
    if not grid.contains(*grid.cell_from_world(here.x, here.y)):
        return settings.start if _stands(world, settings.start, radius) else None
    if _stands(world, here, radius):
        return here
    good = largest_part(np.asarray(world.occupancy == FREE))
    return Placement(*_nearest(good, grid, here[:2]), here.yaw) if good.any() else None


def _stands(world: World, where: Placement, radius: float) -> bool:
    grid = world.grid
    return (grid.contains(*grid.cell_from_world(where.x, where.y))
            and Clearance(world, radius).at(where.x, where.y) >= 0.0)


def _middle(world: World) -> tuple[float, float]:
    low_x, low_y, high_x, high_y = world.pixels.extent
    return (low_x + high_x) / 2.0, (low_y + high_y) / 2.0


def _nearest(
    cells: npt.NDArray[np.bool_], grid: Grid, point: tuple[float, float],
) -> tuple[float, float]:
    """Return the centre of the cell nearest to a point, [m]."""
    centres = grid.world_from_cells(np.argwhere(cells))
    x, y = centres[np.hypot(*(centres - point).T).argmin()].tolist()
    return x, y


def largest_part(free: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """
    Return the largest part of free cells that hang together by their sides.

    Parameters
    ----------
    free : ndarray of bool, shape (n_rows, n_cols)

    Returns
    -------
    ndarray of bool, shape (n_rows, n_cols)

    """
    left, best, n_best = free.copy(), np.zeros_like(free), 0
    n_left = int(left.sum())
    while n_left > n_best:
        part = _part_around(left, int(left.argmax()))
        left &= ~part
        size = int(part.sum())
        n_left -= size
        if size > n_best:
            best, n_best = part, size
    return best


def _part_around(free: npt.NDArray[np.bool_], first: int) -> npt.NDArray[np.bool_]:
    """Return the cells that hang together with one, given by its number in row order."""
    edged = np.pad(free, 1)
    n_cols = edged.shape[1]
    steps, left = np.array([1, -1, n_cols, -n_cols]), edged.reshape(-1).copy()
    row, col = divmod(first, free.shape[1])
    front = np.array([(row + 1) * n_cols + col + 1])
    left[front] = False
    while len(front):
        beside = (front[:, np.newaxis] + steps).reshape(-1)
        front = np.unique(beside[left[beside]])
        left[front] = False
    return np.asarray((edged.reshape(-1) & ~left).reshape(edged.shape)[1:-1, 1:-1])
