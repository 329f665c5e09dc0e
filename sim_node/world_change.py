"""Another world around the robot while it runs: read before it is agreed to, and made."""

from collections.abc import Callable, Mapping
from typing import Any, Final

from msgs_bridge.messages.trial_status import State, TrialStatus
from sim_node.loading import load_anew, Loaded
from sim_node.settings import SimSettings
from sim_node.simulation import Simulation
from sim_node.start import place_in, start_in

_NO_ROOM: Final = '{}: nothing in it is free, a robot of radius {:g} m cannot stand anywhere'
_NOT_NOW: Final = (
    'the world cannot become {} now: {}, and {}; it can once that has ended (stop or keep it)')


class WorldChange:
    """
    Changes the world of a simulation.

    Walls may come and go while the robot drives. What would falsify a recording may not: that the
    robot is set elsewhere, or that the cells become others.

    Parameters
    ----------
    simulation : Simulation
    recorder : callable
        Returns who records a demonstration; empty if nobody does.
    has_controller : callable
        Returns whether who said that a trial runs is still there.

    """

    def __init__(
        self, simulation: Simulation, recorder: Callable[[], str],
        has_controller: Callable[[], bool],
    ) -> None:
        """Start with none that waits."""
        self._simulation, self._recorder = simulation, recorder
        self._has_controller = has_controller
        self._new: Loaded | None = None
        self._trial: TrialStatus | None = None

    def on_status(self, status: TrialStatus) -> None:
        """Note how the controller's trial stands."""
        self._trial = status

    def check(self, settings: SimSettings, named: Mapping[str, Any]) -> None:
        """
        Read the world that other parameters make, for `make`.

        Parameters
        ----------
        settings : SimSettings
            So far.
        named : mapping of str
            Parameters that become others.

        Raises
        ------
        ValueError
            If a parameter is out of range, a file is missing or malformed, the robot can stand
            nowhere, or something is under way that would be falsified.

        """
        self._new = None
        new = load_anew(settings, named, self._simulation.world)
        if new is None:
            return
        here = self._simulation.robot.truth
        place = place_in(new.world, here, new.settings)
        if place is None:
            raise ValueError(_NO_ROOM.format(new.world.name, new.settings.robot_radius))
        is_other = new.world.grid.offset_to(self._simulation.world.grid) is None
        if (is_other or place != here) and (busy := self._under_way()):
            what = ('its cells are others' if is_other else
                    'the robot would stand in an obstacle or outside of it')
            raise ValueError(_NOT_NOW.format(new.world.name, what, busy))
        self._new = new

    def _under_way(self) -> str:
        """Say what is recorded of the robot; empty if nothing is."""
        runs = self._trial is not None and self._trial.state in (State.RUNNING, State.PAUSED)
        if self._trial is not None and runs and self._has_controller():
            return f'trial {self._trial.trial} is {self._trial.state}'
        recorder = self._recorder()
        return f'{recorder} records a demonstration' if recorder else ''

    def make(self, settings: SimSettings) -> tuple[Loaded | None, list[str]]:
        """
        Let the simulation have other parameters, and the world that was checked with them.

        Returns
        -------
        loaded : Loaded or None
            The other world; None if it stays.
        notes : list of str
            What a user should know, a sentence each.

        """
        new, self._new = self._new, None
        before = self._simulation.parameters.start
        settings, note = start_in(new.world if new else self._simulation.world, settings)
        self._simulation.change(settings, *(new[:2] if new else ()))
        if new is None:
            return None, [note] if note and before != settings.start else []
        return new, [*new.world.notes, *self._make_room(settings)]

    def _make_room(self, settings: SimSettings) -> list[str]:
        """Set a robot that would stand in an obstacle to a free place; return what to say."""
        simulation = self._simulation
        here = simulation.robot.truth
        place = place_in(simulation.world, here, settings)
        if place is None or place == here:
            return []
        simulation.place(place)
        note = (f'the robot stood at ({here.x:.2f}, {here.y:.2f}) m, where the world '
                f'{simulation.world.name} has no room for it: it is set to ({place.x:.2f}, '
                f'{place.y:.2f}) m, in free space')
        return [note]
