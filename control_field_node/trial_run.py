"""One trial: decisions, driving and the rules that end it; ROS-free, time comes from stamps."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.headings import heading_from_step
from control_field.parameters import Parameters
from control_field.records import CellFlag, ControlField, Outcome
from control_field.robot.limits import STANDSTILL, Velocity
from control_field.robot.policy import TrialPolicy
from control_field.robot.stop_rules import is_lost, ProgressChecker, StopReason
from control_field_node import words
from control_field_node.drive import Drive
from control_field_node.field_reader import FEW_CELLS
from control_field_node.seen import Seen
from control_field_node.settings import Settings
from msgs_bridge.messages.memory_identity import task_of
from msgs_bridge.messages.poses import Pose

Rows = npt.NDArray[np.void]
_NO_ROWS: Final = ()


@dataclass(frozen=True, slots=True)
class Move:
    """
    What to do in answer to a pose.

    Parameters
    ----------
    velocity : tuple of float, [m/s] and [rad/s]
        Wanted; the collision monitor comes after it.
    rows : tuple of ndarray of DECISION_DTYPE
        Decisions to publish, a table each.
    outcome : Outcome or None
        How the trial has ended.
    reason : str
        One sentence, empty for goal.
    stop : StopReason or None
        The rule that ended it, None for goal.

    """

    velocity: Velocity
    rows: tuple[Rows, ...] = field(default=_NO_ROWS)
    outcome: Outcome | None = None
    reason: str = ''
    stop: StopReason | None = None


def ended_by(
    reason: StopReason, text: str = '', rows: tuple[Rows, ...] = _NO_ROWS,
) -> Move:
    """Return the move that ends a trial for a reason."""
    return Move(STANDSTILL, rows, reason.outcome, text or reason.sentence, reason)


class TrialRun:
    """
    A trial under way.

    Parameters
    ----------
    control_field : ControlField
        What the robot follows.
    parameters : Parameters
        How it decides.
    settings : Settings
        How it drives.
    trial : int
        Number of the trial; seeds what is random together with ``parameters.seed``.

    """

    def __init__(
        self, control_field: ControlField, parameters: Parameters, settings: Settings, trial: int,
    ) -> None:
        """Start at the robot's present cell, wherever that is."""
        self.trial = trial
        self.settings = settings
        self.parameters = parameters
        self.policy = TrialPolicy(
            control_field, parameters, np.random.default_rng(parameters.seed + trial), trial)
        self.drive = Drive(control_field.grid, settings.limits, settings.arrival_tolerance,
                           parameters.corner_cutting, settings.aside)
        self._progress = ProgressChecker(settings.rules)
        self._fresh: ControlField | None = None
        self._is_home = False
        self._followed: Seen | None = None
        self._cell: tuple[int, int] | None = None
        self._n_cells = 0

    @property
    def revision(self) -> int:
        """Return the revision of the field it drives on."""
        return self.policy.field.revision

    @property
    def memory(self) -> str:
        """Return whose field it drives on."""
        return self.policy.field.memory

    def refresh(self, control_field: ControlField) -> None:
        """Take over a field of the same grid at the next decision."""
        self._fresh = control_field

    @property
    def has_large_fresh(self) -> bool:
        """Tell whether a field waits that takes long to be taken over."""
        return self._fresh is not None and self._fresh.vx.size > FEW_CELLS

    def take_fresh(self) -> Move | None:
        """Drive on the field that has come, if one has; return what ends the trial by it."""
        fresh, self._fresh = self._fresh, None
        if fresh is None:
            return None
        if words.is_of_another_task(fresh, self.policy.field):
            return ended_by(StopReason.WRONG_FIELD, StopReason.WRONG_FIELD.told(
                f'it is of task {task_of(fresh.memory)}'))
        self.policy.replace_field(fresh)
        return None

    def interrupt(self) -> None:
        """Forget the way: something else has moved or stopped the robot."""
        self.drive.reset()
        self._progress.restart()
        self._is_home = False
        self._followed = None

    def step(self, pose: Pose, seen: Seen, told: float, ahead: Pose | None = None,
             patience: float = 1.0) -> Move:
        """
        Answer a pose.

        Parameters
        ----------
        pose : Pose
            Where the robot is.
        seen : Seen
            What it sees.
        told : float
            Speed it was told to drive since the last pose, [m/s].
        ahead : Pose, optional
            Where it is by now, with the stamp of ``pose``; that itself by default.
        patience : float
            How many times longer than usual it may take to come forward.

        """
        if self._cell != (seen.row, seen.col):
            self._cell = seen.row, seen.col
            self._n_cells += 1
        stop = self._progress.observe(
            pose.stamp, pose.x, pose.y, pose.yaw, self._n_cells, told, patience)
        if stop is not None:
            return ended_by(stop)
        ahead = ahead or pose
        if not self.drive.is_due(ahead, seen):
            return Move(self.drive.velocity(ahead))
        if self._is_home:
            return Move(STANDSTILL, _NO_ROWS, Outcome.GOAL)
        return self._decide(ahead, seen)

    def follow(self, pose: Pose, seen: Seen) -> Move:
        """Report what a person drives: a row for each step from cell to cell."""
        before, self._followed = self._followed, seen
        if before is None or (before.row, before.col) == (seen.row, seen.col):
            return Move(STANDSTILL)
        try:
            heading = heading_from_step(seen.row - before.row, seen.col - before.col)
        except ValueError:
            return Move(STANDSTILL)
        rows = self.policy.taught(
            before.row, before.col, heading, before.blocked, before.unknown, pose.stamp)
        if self.policy.at_goal(seen.row, seen.col):
            return Move(STANDSTILL, (rows,), Outcome.GOAL)
        return Move(STANDSTILL, (rows,))

    def _decide(self, pose: Pose, seen: Seen) -> Move:
        if (move := self.take_fresh()) is not None:
            return move
        if self.policy.field.is_void:
            return ended_by(StopReason.NO_FIELD)
        if self.policy.at_goal(seen.row, seen.col):
            self._is_home = True
            self.drive.to_centre(pose)
            return self._step_home(pose, seen)
        if self._is_lost(seen):
            return ended_by(StopReason.LOW_COHERENCE)
        choice = self.policy.decide(seen.row, seen.col, seen.blocked, seen.unknown, pose.stamp)
        rows = (choice.decisions,) if len(choice.decisions) else _NO_ROWS
        if choice.heading < 0:
            limit = self.policy.n_steps >= self.parameters.step_limit
            return ended_by(
                StopReason.STEP_LIMIT if limit else StopReason.NO_WAY, choice.reason, rows)
        self.drive.go(choice.heading, pose, seen)
        return Move(self.drive.velocity(pose), rows)

    def _step_home(self, pose: Pose, seen: Seen) -> Move:
        """Drive the last piece to the goal's centre."""
        if self.drive.is_due(pose, seen):
            return Move(STANDSTILL, _NO_ROWS, Outcome.GOAL)
        return Move(self.drive.velocity(pose))

    def _is_lost(self, seen: Seen) -> bool:
        place = seen.row, seen.col
        learnt = self.policy.field
        return is_lost(
            float(learnt.coherence[place]), bool(learnt.flags[place] & CellFlag.SUPPORTED),
            float(abs(learnt.q[place]).max()), self.settings.least_coherence)
