"""What moves in a world, as the headless world wants it: in cells and ticks."""

from collections.abc import Sequence
import math
from typing import Final

import numpy as np

from control_field.kernels.moving_world import Moving, Pace
from world_maps.changes import Change
from world_maps.mover import Mover, tracks
from world_maps.world import World

#: A tick, [s], and how long movers are followed, [ticks]: after that they stand.
TICK: Final = 0.1
N_TICKS: Final = 12_000


def moving_in_cells(
    world: World, movers: Sequence[Mover], changes: Sequence[Change] = (), seed: int = 0,
    n_ticks: int = N_TICKS,
) -> Moving:
    """
    Return what moves and changes in ticks of `TICK`.

    Parameters
    ----------
    world : World
    movers : sequence of Mover
    changes : sequence of Change
        Those at a time count: from the beginning of each trial. Those at a trial are the
        caller's.
    seed : int
        Of what is random about movers.
    n_ticks : int

    Raises
    ------
    ValueError
        If there is no room for a mover; the message says which.

    """
    grid, places = world.grid, np.full((n_ticks, len(movers), 2), np.nan)
    for m, track in enumerate(tracks(movers, world, seed)):
        for tick in range(n_ticks):
            place = track.at(tick * TICK)
            if place is not None:
                places[tick, m] = ((place[1] - grid.origin_y) / grid.resolution,
                                   (place[0] - grid.origin_x) / grid.resolution)
    return Moving(
        places, np.array([mover.radius / grid.resolution for mover in movers], dtype=np.float64),
        np.array([math.ceil(mover.patience / TICK) for mover in movers], dtype=np.int64),
        _events(changes))


def _events(changes: Sequence[Change]) -> np.typing.NDArray[np.int64]:
    rows = [(math.ceil(change.at_time / TICK), row, col, int(change.states[row, col]))
            for change in sorted((c for c in changes if c.at_time is not None),
                                 key=lambda c: c.at_time or 0.0)
            for row, col in np.argwhere(change.cells).tolist() if change.at_time is not None]
    return np.array(rows, dtype=np.int64).reshape(-1, 4)


def pace_in_cells(
    world: World, speed: float = 0.22, radius: float = 0.105, patience: float = 2.0,
    flips: float = 0.0,
) -> Pace:
    """
    Return how a robot drives in cells and ticks.

    Parameters
    ----------
    speed : float, [m/s]
    radius : float, [m]
        More than 0.45 of a cell is taken as that: the headless robot drives on cell centres.
    patience : float, [s]
        How long it waits for what comes into its way.
    flips : float
        Share of the cells it sees that are shown wrongly, at random.

    """
    side = world.grid.resolution
    return Pace(speed * TICK / side, min(radius / side, 0.45), round(patience / TICK), flips)
