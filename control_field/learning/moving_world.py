"""Trials on a grid world in which things move, without a robot."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from control_field.kernels import compiled
from control_field.kernels.decision import Log, TrialState
from control_field.kernels.moving_world import Moving, Pace
from control_field.learning.grid_world import fresh, GridWorld
from control_field.learning.judge import Runs
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.policy import options_of


class MovingWorld(GridWorld):
    """
    A true map with what moves in it.

    Each trial begins at a tick of the movers that its seed draws, so that it meets them elsewhere
    than the last one did. The robot never drives into what moves (its collision monitor is taken
    to be perfect); a mover that runs into the robot stands there, and is counted.

    Parameters
    ----------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, anything else blocked.
    parameters : Parameters
    moving : Moving
    pace : Pace
    sight : int, [cells]
        As in `GridWorld`: what moves is seen as far, and hides what lies behind it.

    Attributes
    ----------
    n_mover_contacts : int
        How often a mover ran into the robot, in all trials so far.

    """

    def __init__(
        self, occupancy: npt.NDArray[np.int8], parameters: Parameters, moving: Moving, pace: Pace,
        sight: int = 3,
    ) -> None:
        super().__init__(occupancy, parameters, sight)
        self.moving, self.pace = moving, pace
        self.n_mover_contacts = 0

    def with_parameters(self, parameters: Parameters) -> 'MovingWorld':
        """Return the same world for a robot with other parameters."""
        return MovingWorld(self.truth, parameters, self.moving, self.pace, self.sight)

    def trials(self, field: ControlField, starts: npt.NDArray[np.integer], seed: int,
               watch: Callable[[int], None] | None = None) -> Runs:
        """Run a trial from every start, as `GridWorld.trials`; each meets what moves anew."""
        log, ready = self._new_log(0), self._ready(field)
        table = np.zeros((len(starts), 5))
        for index, (row, col) in enumerate(np.asarray(starts).tolist()):
            table[index] = self._run(ready, (row, col), seed + index, log)
            if watch is not None:
                watch(index + 1)
        return Runs(table[:, 0].astype(np.int8), table[:, 1].astype(np.int64),
                    table[:, 4].astype(np.int64), table[:, 3])

    def _run(self, ready: TrialState, start: tuple[int, int], seed: int,
             log: Log) -> tuple[int, int, int, float, int]:
        trial, rng = fresh(ready), np.random.default_rng(seed)
        begin = int(rng.integers(max(len(self.moving.places) // 2, 1)))
        scene = compiled.new_scene(
            self.moving, self.truth, trial.ground.known, start, begin)
        result: tuple[int, int, int, float, int] = compiled.run_moving_trial(
            scene, self.pace, trial, options_of(self.parameters), self.parameters.step_limit,
            rng, log, self._scanner)
        self.n_mover_contacts += int(scene.counts[1])
        return result
