"""The newest neighbourhood, where it lies, and why it does not count."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.local_grid import UNKNOWN
from control_field.records import ControlField
from control_field.robot.motion_watch import MotionWatch
from control_field_node.inputs.input_monitor import InputMonitor
from control_field_node.inputs.localisation import Localisation
from control_field_node.inputs.observation import LocalGridRules, Observation, ObservationCache
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose, problem_with_frame


class LocalGridBuffer:
    """
    Keeps the newest neighbourhood.

    Parameters
    ----------
    inputs : InputMonitor
        What is out of order, and what is stale.
    localisation : Localisation
        Where a neighbourhood belongs where odometry is corrected.

    Attributes
    ----------
    newest : Neighbourhood or None
    rules : LocalGridRules
        How it is taken.

    """

    def __init__(self, inputs: InputMonitor, localisation: Localisation) -> None:
        """Start without a neighbourhood."""
        self.newest: Neighbourhood | None = None
        self.rules = LocalGridRules()
        self._motion, self._moving = MotionWatch(), np.zeros((0, 0), dtype=np.bool_)
        self._known = np.zeros((0, 0), dtype=np.int8)
        self._cells: Grid | None = None
        self._inputs, self._localisation = inputs, localisation
        self._cache = ObservationCache()

    def take_field(self, field: ControlField) -> None:
        """Take over workspace and memory; what lies on cells of no such side is read again."""
        self._known = np.pad(field.known, 1, constant_values=UNKNOWN)
        if self._cells == field.grid:
            return
        offset = None if self._cells is None else self._cells.offset_to(field.grid)
        if offset is None or self.newest is None:
            self.newest = self._cells = None
            self._motion.forget()
            return
        rows, cols = offset
        self.newest = replace(
            self.newest, row=self.newest.row + rows, col=self.newest.col + cols)
        self._cells = field.grid
        self._motion.shift(rows, cols)

    def add(
        self, neighbourhood: Neighbourhood, cells: Grid | None, now: float, is_paused: bool,
    ) -> None:
        """
        Take in a neighbourhood; ignore one that is out of order.

        Parameters
        ----------
        neighbourhood : Neighbourhood
        cells : Grid or None
            The workspace that its row and column count in.
        now : float, [s]
            On the steady clock.
        is_paused : bool
            Whether the robot stands because something is missing.

        """
        is_late = self._inputs.is_out_of_order(neighbourhood, self.newest)
        self._inputs.refusals.counts['late neighbourhoods'] += is_late
        if is_late:
            self._inputs.local_grid.pass_over(
                now, f'its stamps go back (last {neighbourhood.stamp:.2f} s)')
            return
        if cells != self._cells:
            self._motion.forget()
        self.newest, self._cells = neighbourhood, cells
        self._moving = self._find_moving(neighbourhood)
        self._inputs.on_local_grid(now, is_paused)

    def _find_moving(self, neighbourhood: Neighbourhood) -> npt.NDArray[np.bool_]:
        row, col, seen = neighbourhood.row, neighbourhood.col, neighbourhood.finest
        k = len(seen) // 3
        # It has an edge of unknown cells.
        known = self._known[max(row, 0):max(row + 3, 0), max(col, 0):max(col + 3, 0)]
        remembered = known.repeat(k, axis=0).repeat(k, axis=1)
        return self._motion.moving(
            neighbourhood.stamp, ((row - 1) * k, (col - 1) * k), seen, k,
            remembered if remembered.shape == seen.shape else None)

    def observe(
        self, pose: Pose | None, now: float, unknown_is_blocked: bool, bounded: bool = True,
    ) -> Observation | None:
        """Return what is observed from a pose; None if nothing is, or what there is is stale."""
        local_grid, cells = self.newest, self._cells
        if local_grid is None or cells is None or pose is None or self.problem(pose, now):
            return None
        return self._cache.get(
            self._localisation.moved(local_grid), cells,
            replace(self.rules, unknown_is_blocked=unknown_is_blocked, bounded=bounded),
            self._moving)

    def problem(self, pose: Pose | None, now: float) -> str:
        """Return why nothing is observed from a pose; empty if something is."""
        local_grid, cells, timeout = self.newest, self._cells, self._inputs.local_grid
        if pose is None or self._inputs.odometry.is_stale(now):
            return self._inputs.odometry.absence(now, 'odometry')
        if local_grid is None or cells is None or timeout.is_stale(now):
            return timeout.absence(now, 'neighbourhood')
        if abs(apart := pose.stamp - local_grid.stamp) > timeout.timeout:
            return (f'the stamp of the neighbourhood is {abs(apart):.2f} s '
                    f'{"behind" if apart > 0.0 else "ahead of"} that of odometry, must be at most '
                    f'neighbourhood_timeout ({timeout.timeout:g} s)')
        return problem_with_frame(pose.frame_id, cells.frame_id, 'odom')
