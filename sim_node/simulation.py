"""The simulated robot in its world: commands in, ticks on, what it senses out. ROS-free."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Final

import numpy as np
import numpy.typing as npt

from sim_node.contacts import Contacts, Surroundings
from sim_node.robot import Placement, Robot
from sim_node.seen import seen_from
from sim_node.settings import SimSettings
from world_maps.changes import Change, ChangingWorld
from world_maps.clearance import Clearance
from world_maps.mover import Mover
from world_maps.movers import Disc, Movers
from world_maps.movers_file import Script
from world_maps.world import World

#: What it is called where the robot cannot stand there.
_START: Final = 'the start (start_x, start_y)'


@dataclass(frozen=True)
class LocalGrid:
    """
    The neighbourhood as a robot gets it.

    Its sensors are where the robot truly is, but the robot places what they see by its odometry:
    ``cells`` is cut out around the true cell, ``row, col`` is the cell of the odometry. Without
    slip and drift the two are the same.
    """

    row: int
    col: int
    cells: npt.NDArray[np.int8]
    fine: npt.NDArray[np.int8] | None = None  #: the same in finer cells, if it has them


class Simulation:
    """
    A robot in a world, in simulated time.

    Parameters
    ----------
    world : World
    parameters : SimSettings
        Its ``world`` is not looked at: files are the caller's business.
    movers : sequence of Mover
        What moves in it.
    changes : sequence of Change
        What becomes of it.

    Raises
    ------
    ValueError
        If the robot cannot stand where it should start, or a mover has no room.

    """

    def __init__(
        self, world: World, parameters: SimSettings, movers: Sequence[Mover] = (),
        changes: Sequence[Change] = (),
    ) -> None:
        """Put the robot at its start."""
        self.parameters = parameters
        self.movers = Movers(movers, world, parameters.seed)
        self._changing = ChangingWorld(world, changes)
        self._check_placement(parameters.start, _START, self._room_in(world))
        self.contacts = Contacts()
        self.robot = Robot(parameters.body, parameters.wheels, parameters.start)
        self.reset()

    def reset(self) -> None:
        """
        Start anew: robot at the start, contacts forgotten, the same random numbers again.

        What moves and what changes begins anew, too.

        Raises
        ------
        ValueError
            If the robot cannot stand at its start in this world; nothing is changed then.

        """
        clearance = self._room_in(self._changing.first)
        self._check_placement(self.parameters.start, _START, clearance)
        self._changing.reset()
        self._clearance = clearance
        self.place(self.parameters.start, _START)
        self._rng = np.random.default_rng(self.parameters.seed)
        self.movers.reset()
        self.contacts = Contacts()
        self.seconds, self._last_trial = 0.0, -1
        self._n_ticks = self._n_walls = 0
        self._update_world()

    @property
    def world(self) -> World:
        """Return what is true now."""
        return self._changing.world

    @property
    def in_contact(self) -> bool:
        """Return whether the robot touches something, as a bumper feels it."""
        return self._at_wall or bool(self.contacts.touching)

    @property
    def has_collided(self) -> bool:
        """Return whether it touches what it has run into itself."""
        return self._at_wall or bool(self.contacts.run_into)

    @property
    def n_collisions(self) -> int:
        """Return how often the robot ran into something, be it a mover."""
        return self._n_walls + self.contacts.n_robot

    @property
    def n_robot_contacts(self) -> int:
        """Return how often the robot ran into a mover: its own motion closed the gap."""
        return self.contacts.n_robot

    @property
    def n_mover_contacts(self) -> int:
        """Return how often a mover ran into the robot, which did not drive towards it."""
        return self.contacts.n_mover

    def place(self, where: Placement, name: str = 'the place') -> None:
        """
        Put the robot somewhere; it stands still there, and its odometry knows.

        Where something moves it may be placed, too: the two part freely, which is no contact.

        Raises
        ------
        ValueError
            If it is not finite, outside the workspace, or touches an obstacle; the robot stays
            where it is then.

        """
        self._check_placement(where, name, self._clearance)
        self.robot.place(where)
        self._at_wall = False
        self.contacts.part()
        self._command = (0.0, 0.0)
        self._command_age = math.inf

    def change(
        self, parameters: SimSettings, world: World | None = None, script: Script | None = None,
    ) -> None:
        """
        Take other parameters and, if given, another world; the robot stays where it is.

        A robot that finds itself in an obstacle of the new world can only move out of it. What
        moves begins anew with another seed or script; in another world nothing does without one.
        """
        if parameters.seed != self.parameters.seed:
            self._rng = np.random.default_rng(parameters.seed)
        if world is not None or script is not None or parameters.seed != self.movers.seed:
            if script is None:
                script = Script() if world is not None else Script(
                    self.movers.movers, self._changing.changes)
            world = world or self._changing.first
            self.movers = Movers(script.movers, world, parameters.seed)
            self._changing = ChangingWorld(world, script.changes)
            self.contacts.part()
            self.seconds = 0.0
        self.parameters = parameters
        self.robot.body, self.robot.wheels = parameters.body, parameters.wheels
        if world is not None or self._clearance.radius != parameters.robot_radius:
            self._clearance = self._room_in(self.world)
            self._at_wall = self._clearance.at(*self.robot.truth[:2]) < 0.0
            self._update_world()

    def on_trial_end(self, number: int) -> None:
        """Make the changes that come after a trial (0: a demonstration)."""
        self._last_trial = number
        self._update_world()

    def _update_world(self) -> None:
        if self._changing.update(self.seconds, self._last_trial, self._disc):
            self._clearance = self._room_in(self.world)

    def _room_in(self, world: World) -> Clearance:
        return Clearance(world, self.parameters.robot_radius)

    def command(self, v: float, w: float) -> None:
        """
        Take a command; it holds until the next one or until it is stale.

        Raises
        ------
        ValueError
            If it is not finite; the last one stays.

        """
        if not (math.isfinite(v) and math.isfinite(w)):
            raise ValueError(f'command is ({v}, {w}), must be finite')
        self._command = (v, w)
        self._command_age = 0.0

    @property
    def is_stale(self) -> bool:
        """Return whether the last command is too old to be followed."""
        return self._command_age >= self.parameters.cmd_vel_timeout - 1e-9

    @property
    def is_commanded(self) -> bool:
        """Return whether the last command, stale or not, asks for motion."""
        return self._command != (0.0, 0.0)

    def tick(self, seconds: float) -> bool:
        """
        Let time pass.

        Parameters
        ----------
        seconds : float
            A tick; the command is the same during it.

        Returns
        -------
        bool
            Whether the robot ran into something in this tick.

        """
        v, w = (0.0, 0.0) if self.is_stale else self._command
        before, discs = self._disc, self.movers.discs
        hit = self.robot.drive(
            v, w, seconds, Surroundings(self._clearance, discs), self._rng)
        self._command_age += seconds
        self.seconds += seconds
        self._n_ticks += 1
        held = self.movers.advance(seconds, self._disc)
        at_mover = self.contacts.on_tick(
            (before, self._disc), discs, self.movers.discs, hit, held)
        at_wall = hit and not at_mover
        self._n_walls += at_wall and not self._at_wall
        moved = self._disc != before
        self._at_wall = at_wall or (self._at_wall and not moved)
        self._update_world()
        return hit

    def local_grid(self) -> LocalGrid:
        """Return the neighbourhood as the robot gets it."""
        cell = self.world.grid.cell_from_world
        truth, odometry = self.robot.truth, self.robot.odometry
        return LocalGrid(*cell(odometry.x, odometry.y), *seen_from(
            self.world, self.movers.discs, *cell(truth.x, truth.y), self.parameters,
            self._n_ticks))

    @property
    def _disc(self) -> Disc:
        return Disc(*self.robot.truth[:2], self.parameters.robot_radius)

    def _check_placement(self, where: Placement, name: str, clearance: Clearance) -> None:
        x, y = where.x, where.y
        if not all(map(math.isfinite, where)):
            raise ValueError(f'{name} is ({x}, {y}) with yaw {where.yaw}, must be finite')
        if not self.world.grid.contains(*self.world.grid.cell_from_world(x, y)):
            raise ValueError(f'{name} is ({x:g}, {y:g}) m, outside the world {self.world.name}, '
                             f'{self._extent()}')
        if clearance.at(x, y) < 0.0:
            raise ValueError(
                f'{name} is ({x:g}, {y:g}) m, where a robot of radius '
                f'{self.parameters.robot_radius:g} m touches an obstacle or wall of the world '
                f'{self.world.name}')

    def _extent(self) -> str:
        grid = self.world.grid
        high_x = grid.origin_x + grid.n_cols * grid.resolution
        high_y = grid.origin_y + grid.n_rows * grid.resolution
        return (f'which goes from ({grid.origin_x:g}, {grid.origin_y:g}) to '
                f'({high_x:g}, {high_y:g}) m')
