"""One trial: decisions, driving and the rules that end it; ROS-free, time comes from stamps."""

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.headings import heading_from_step
from control_field.parameters import Parameters
from control_field.records import CellFlag, ControlField, Outcome
from control_field.robot.limits import STANDSTILL, Velocity
from control_field.robot.patience import Patience
from control_field.robot.policy import TrialPolicy
from control_field.robot.ready_states import ReadyStates
from control_field.robot.stop_rules import is_lost, ProgressChecker, StopReason
from control_field_node.driving.path_tracker import PathTracker
from control_field_node.driving.way_watch import WayWatch
from control_field_node.inputs.observation import Observation
from control_field_node.settings import Settings
from msgs_bridge.messages.memory_identity import is_of_another_task, task_of
from msgs_bridge.messages.poses import Pose

Rows = npt.NDArray[np.void]
_NO_ROWS: Final = ()
#: Cells of a field that a trial changes to in a few milliseconds, with nothing ready.
FEW_CELLS: Final = 5000
#: What a robot says that waits.
WAITING: Final = 'waits for something in the way'


@dataclass(frozen=True, slots=True)
class Answer:
    """
    What to publish in answer to an input.

    Parameters
    ----------
    velocity : tuple of float or None, [m/s] and [rad/s]
        For `cmd_vel`; None: nothing.
    rows : tuple of ndarray of DECISION_DTYPE
        For `experience`, a message each.
    requested : tuple of float or None
        What the field wanted, where the collision monitor let something else through.

    """

    velocity: Velocity | None = None
    rows: tuple[Rows, ...] = ()
    requested: Velocity | None = None


NOTHING: Final = Answer()
STOP: Final = Answer(STANDSTILL)


@dataclass(frozen=True, slots=True)
class Move:
    """
    What a trial does in answer to a pose.

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
    states : ReadyStates
        What was made ready for it.

    Attributes
    ----------
    waiting : str
        That the robot waits for what is in its way, in a sentence; empty if it does not.

    """

    def __init__(
        self, control_field: ControlField, parameters: Parameters, settings: Settings, trial: int,
        states: ReadyStates,
    ) -> None:
        """Start at the robot's present cell, wherever that is."""
        self.trial = trial
        self.parameters = parameters
        self.policy = TrialPolicy(
            control_field, parameters, np.random.default_rng(parameters.seed + trial), trial,
            states.take(control_field, parameters))
        self._states = states
        self._tracker = PathTracker(
            control_field.grid, settings.limits, settings.arrival_tolerance,
            parameters.corner_cutting, settings.aside)
        self._progress = ProgressChecker(settings.rules)
        self._way = WayWatch(
            control_field.known, self.policy.state.ground.rules, settings.patience)
        self._kept_back = Patience(settings.patience)
        self._looks = Patience(settings.patience)
        self._waits_in: tuple[int, int] | None = None
        self.waiting = ''
        self._least_coherence = settings.least_coherence
        #: The field that is changed to next, if one has come.
        self.new_field: ControlField | None = None
        self._is_in_goal_cell = False
        self._followed: Observation | None = None
        self._observed: Observation | None = None
        self._cell: tuple[int, int] | None = None
        self._n_cells = 0

    @property
    def grid(self) -> Grid:
        """Return the workspace it drives in."""
        return self.policy.field.grid

    @property
    def revision(self) -> int:
        """Return the revision of the field it drives on."""
        return self.policy.field.revision

    @property
    def memory(self) -> str:
        """Return whose field it drives on."""
        return self.policy.field.memory

    def refresh(self, control_field: ControlField) -> None:
        """Drive on a field of the same lattice from the next decision on."""
        self.new_field = control_field

    @property
    def stands_to_change(self) -> bool:
        """Return whether a field is waiting that takes long, or whose workspace is another."""
        new = self.new_field
        return new is not None and (new.grid != self.grid or (
            new.vx.size > FEW_CELLS and not self._states.holds(new, self.parameters)))

    def change_field(self) -> Move | None:
        """Change to the field that is waiting, if any; return the move if that ends the trial."""
        new, self.new_field = self.new_field, None
        if new is None:
            return None
        if is_of_another_task(new.memory, self.memory):
            return ended_by(StopReason.WRONG_FIELD, StopReason.WRONG_FIELD.sentence_with(
                f'it is of task {task_of(new.memory)}'))
        before = self.grid
        self.policy.replace_field(new, self._states.take(new, self.parameters))
        if new.grid != before:
            self._move(before)
        self._way.learn(new.known)
        return None

    def _move(self, before: Grid) -> None:
        """Go on in the workspace of the new field: every place stays, its cell has a new name."""
        self._way.move(before, self.grid)
        self._tracker.grid = self.grid
        self.interrupt()
        self._cell = self._observed = None

    def rest(self) -> None:
        """Stand for a while, and go on where it was."""
        self._progress.restart()
        self.waiting = ''

    def interrupt(self) -> None:
        """Forget the path: something else has moved or stopped the robot."""
        self._tracker.reset()
        self.rest()
        self._is_in_goal_cell, self._waits_in = False, None
        self._followed = None

    def step(self, pose: Pose, observation: Observation, commanded_speed: float,
             predicted: Pose | None = None, patience: float = 1.0,
             is_kept_back: bool = False) -> Move:
        """
        Answer a pose.

        Parameters
        ----------
        pose : Pose
            Where the robot is.
        observation : Observation
        commanded_speed : float, [m/s]
            Since the last pose.
        predicted : Pose, optional
            Where it is by now, with the stamp of ``pose``; that itself by default.
        patience : float
            How many times longer than usual it may take to make progress.
        is_kept_back : bool
            Whether the collision monitor has kept it back for something that moves.

        """
        self._remember(observation)
        if self._cell != observation.cell:
            self._cell = observation.cell
            self._n_cells += 1
        has_waited = self._kept_back.lasts(pose.stamp, is_kept_back or None) or bool(self.waiting)
        stop = self._progress.observe(pose.stamp, pose.x, pose.y, pose.yaw, self._n_cells,
                                      commanded_speed, patience, has_waited)
        if stop is not None:
            return ended_by(stop)
        predicted, self.waiting = predicted or pose, ''
        self._way.look(observation)
        step = self._tracker.step_under_way(predicted)
        if step is not None and self._way.is_to_wait(pose.stamp, *step):
            return self._wait()
        self._tracker.update(predicted, observation)
        # Who stands and waits may not be where it was due any more, as predicted: that counts.
        if self._waits_in != observation.cell and not self._tracker.is_due(predicted, observation):
            return Move(self._tracker.velocity(predicted))
        self._waits_in = None
        if self._is_in_goal_cell:
            return Move(STANDSTILL, _NO_ROWS, Outcome.GOAL)
        return self._decide(predicted, observation)

    def _wait(self) -> Move:
        self.waiting = WAITING
        return Move(STANDSTILL)

    def follow(self, pose: Pose, observation: Observation) -> Move:
        """Report what a person drives: a row for each step from cell to cell."""
        self._remember(observation)
        before, self._followed = self._followed, observation
        if before is None or before.cell == observation.cell:
            return Move(STANDSTILL)
        try:
            heading = heading_from_step(observation.row - before.row, observation.col - before.col)
        except ValueError:
            return Move(STANDSTILL)
        rows = self.policy.taught(
            *before.cell, heading, before.blocked, before.unknown, pose.stamp)
        if self.policy.at_goal(*observation.cell):
            return Move(STANDSTILL, (rows,), Outcome.GOAL)
        return Move(STANDSTILL, (rows,))

    def _remember(self, observation: Observation) -> None:
        """Remember what a new observation shows beyond the cells that decisions go by."""
        if observation is not self._observed and observation.is_wide:
            self.policy.observe(*observation.cell, observation.cells)
        self._observed = observation

    def _decide(self, pose: Pose, observation: Observation) -> Move:
        if (move := self.change_field()) is not None:
            return move
        if self.policy.field.is_void:
            return ended_by(StopReason.NO_FIELD)
        if self.policy.at_goal(*observation.cell):
            self._is_in_goal_cell = True
            self._tracker.approach_centre(pose)
            return self._approach_goal(pose, observation)
        if self._is_lost(observation.cell):
            return ended_by(StopReason.LOW_COHERENCE)
        if self._looks.lasts(pose.stamp, self._way.n_looks or None) or self._way.is_to_wait(
                pose.stamp, observation.cell, self.policy.heading(*observation.cell)):
            self._waits_in = observation.cell
            return self._wait()
        choice = self.policy.decide(
            *observation.cell, observation.blocked, observation.unknown, pose.stamp)
        rows = (choice.decisions,) if len(choice.decisions) else _NO_ROWS
        if choice.heading < 0:
            limit = self.policy.n_steps >= self.parameters.step_limit
            if not limit and self.policy.doubts and self._way.looks_again(self.policy.state):
                self._waits_in = observation.cell
                return replace(self._wait(), rows=rows)
            return ended_by(
                StopReason.STEP_LIMIT if limit else StopReason.NO_WAY, choice.reason, rows)
        self._tracker.start_step(choice.heading, pose, observation)
        return Move(self._tracker.velocity(pose), rows)

    def _approach_goal(self, pose: Pose, observation: Observation) -> Move:
        """Drive the last piece to the goal's centre."""
        self._tracker.update(pose, observation)
        if self._tracker.is_due(pose, observation):
            return Move(STANDSTILL, _NO_ROWS, Outcome.GOAL)
        return Move(self._tracker.velocity(pose))

    def _is_lost(self, cell: tuple[int, int]) -> bool:
        learnt = self.policy.field
        return is_lost(
            float(learnt.coherence[cell]), bool(learnt.flags[cell] & CellFlag.SUPPORTED),
            float(abs(learnt.q[cell]).max()), self._least_coherence)
