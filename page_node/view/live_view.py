"""The live view: what arrives from the robot becomes frames where viewers find them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import math
import time
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.records import ControlField, Prototypes
from control_field.robot.limits import Velocity
from msgs_bridge.messages.poses import Pose
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.status_tracker import StatusTracker
from page_node.field_frames import field_frame, prototypes_frame
from page_node.view.advice import advice_for
from page_node.view.frames import (
    decision_frame, local_grid_frame, movers_frame, robot_frame, truth_frame)
from page_node.view.motion import Motion
from page_node.view.situation import NO_TRIAL, Situation
from page_node.view.trail import Point, Trail

#: Between two frames of where the robot is, [s]: no screen shows more.
_FRAME_PERIOD: Final = 1.0 / 30.0
#: The same for one that stands, [s].
_STILL_PERIOD: Final = 0.5
#: Time that the learner waits between two trials where nothing is amiss, [s].
_LOOKING_AROUND: Final = 2.0
#: Time without odometry after which there is no robot, [s].
_ROBOT_TIMEOUT: Final = 3.0


class Viewers(Protocol):
    """Where frames go."""

    def put(
        self, kind: str, content: Mapping[str, Any], arrays: Mapping[str, Any] | None = None,
    ) -> None:
        """Show a frame instead of the last one of its kind."""

    def drop(self, kind: str) -> None:
        """Show a kind no more."""

    def begin_trail(self, kind: str, points: Sequence[Point] = ()) -> None:
        """Begin the way driven anew."""

    def extend_trail(self, points: Sequence[Point]) -> None:
        """Add to the way driven."""


@dataclass
class Surroundings:
    """
    What others tell the view when it asks.

    Parameters
    ----------
    conflict : callable
        Returns what does not fit among the nodes; empty if all does.
    driver : callable
        Returns ``nobody`` or who drives.
    speeds : callable
        Returns forward speed and turning rate of a full push, [m/s] and [rad/s].
    tries_left : callable
        Returns how many trials a person wants yet of a real robot.

    """

    conflict: Callable[[], str] = lambda: ''
    driver: Callable[[], str] = lambda: 'nobody'
    speeds: Callable[[], Velocity] = lambda: (0.0, 0.0)
    tries_left: Callable[[], int] = lambda: 0
    on_trial: Callable[[TrialStatus], object] = lambda trial: None  #: is told of each
    is_simulated: bool = False  #: what is set, until the learner says it
    radius: float = 0.105  #: of the robot, [m]
    #: Whether what was learnt is of other cells than the world has.
    has_other_cells: Callable[[], bool] = lambda: False


@dataclass
class _Shown:
    """What is shown of the field, and what was shown last."""

    grid: Grid | None = None
    goal: list[float] | None = None
    task: str = ''
    state: Mapping[str, Any] = field(default_factory=dict)
    local_grid: Mapping[str, Any] = field(default_factory=dict)


class LiveView:
    """
    Makes frames of what arrives; called by one thread.

    Parameters
    ----------
    viewers : Viewers
    tracker : StatusTracker
        Knows learner and controller.
    around : Surroundings

    """

    def __init__(self, viewers: Viewers, tracker: StatusTracker, around: Surroundings) -> None:
        """Start with nothing seen."""
        self.around = around
        self._viewers, self._tracker = viewers, tracker
        self._trail, self._trail_of = Trail(), ''
        self._motion = Motion()
        self._shown = _Shown()
        self._prototypes: Prototypes | None = None
        self._trial = NO_TRIAL
        self._map: tuple[Grid, npt.NDArray[np.int8]] | None = None
        self._robot_seen = self._robot_shown = -math.inf
        self._phase, self._phase_since = '', -math.inf
        self._place = (math.nan, math.nan, math.nan)

    def on_pose(self, pose: Pose, now: float) -> None:
        """Show where the robot is, and the way it takes."""
        self._robot_seen = now
        self._motion.on_pose(pose, now)
        if self._trail_of:
            self._extend(pose)
        wait = _FRAME_PERIOD if (pose.x, pose.y, pose.yaw) != self._place else _STILL_PERIOD
        if now - self._robot_shown >= wait:
            self._robot_shown, self._place = now, (pose.x, pose.y, pose.yaw)
            self._viewers.put('robot', robot_frame(pose, self.around.radius))

    def _extend(self, pose: Pose) -> None:
        is_new = self._trail.add(pose.x, pose.y)
        if is_new:
            self._viewers.extend_trail(self._trail.points[-1:])
        elif is_new is None:
            self._viewers.begin_trail(self._trail_of, self._trail.points)

    def on_local_grid(self, grid: Grid, cells: npt.NDArray[np.int8]) -> None:
        """Show what the robot sees around it, where it has changed."""
        frame = local_grid_frame(grid, cells)
        if frame != self._shown.local_grid:
            self._shown.local_grid = frame
            self._viewers.put('sight', frame)

    def on_field(self, new: ControlField) -> None:
        """Show a field, and the prototypes that came with it or before it."""
        self._shown.grid = new.grid
        self._shown.goal = None if new.is_void else list(new.grid.world_from_cell(*new.goal))
        self._viewers.put('field', *field_frame(new))
        self._show_prototypes()

    def on_prototypes(self, prototypes: Prototypes) -> None:
        """Show prototypes; where they lie is known from the field."""
        self._prototypes = prototypes
        self._show_prototypes()

    def _show_prototypes(self) -> None:
        if self._prototypes is not None and self._shown.grid is not None:
            self._viewers.put('prototypes', *prototypes_frame(self._prototypes, self._shown.grid))

    def on_map(self, grid: Grid, occupancy: npt.NDArray[np.int8]) -> None:
        """Show how a simulated world is, once it is known to be one; a real one's map is none."""
        self._map = grid, occupancy

    def _show_map(self) -> None:
        if self._map is not None and self.is_simulated:
            self._viewers.put('truth', *truth_frame(*self._map))
            self._map = None

    def on_movers(self, markers: Sequence[Any]) -> None:
        """Show what moves."""
        self._viewers.put('movers', movers_frame(markers))

    def on_decisions(self, decisions: npt.NDArray[np.void]) -> None:
        """Show the newest decision."""
        if len(decisions):
            self._viewers.put('decision', decision_frame(decisions, self._shown.grid))

    def on_trial(self, trial: TrialStatus) -> None:
        """Note how the trial stands; how the last one ended stays, until there is another."""
        self._tracker.on_trial(trial)
        self.around.on_trial(trial)
        if trial.state is State.IDLE and trial.trial == self._trial.trial:
            return
        is_new = trial.state is State.RUNNING and (
            trial.trial != self._trial.trial or self._trial.state is State.ENDED)
        self._trial = trial
        if is_new:
            self._begin_trail('trial')
        elif trial.state is State.ENDED and self._trail_of == 'trial':
            self._trail_of = ''

    def _begin_trail(self, kind: str) -> None:
        self._trail_of = kind
        self._trail.begin()
        self._viewers.begin_trail(kind)

    @property
    def is_simulated(self) -> bool:
        """Whether the robot may be set somewhere."""
        said = self._tracker.learner_values.get('simulation', '')
        return said == 'true' if said else self.around.is_simulated

    def refresh(self) -> None:
        """Show the state if it has changed; called a few times a second."""
        now = time.monotonic()
        self._show_map()
        self._look_at_task(self._tracker.learner_values.get('task', ''))
        situation = self.situation(now)
        phase = situation.status.phase
        if phase == 'demonstration' and self._trail_of != 'demo':
            self._begin_trail('demo')
            self._motion.begin(now)
        elif phase != 'demonstration' and self._trail_of == 'demo':
            self._trail_of = ''
        state = self._state(situation)
        if state != self._shown.state:
            self._shown.state = state
            self._viewers.put('state', state)

    def _look_at_task(self, task: str) -> None:
        """Show nothing more of the task before, once the learner is at another one."""
        if task and task != self._shown.task:
            if self._shown.task:
                self._trial = NO_TRIAL
                self._begin_trail('')
            self._shown.task = task

    def situation(self, now: float) -> Situation:
        """Return how things stand."""
        tracker, around = self._tracker, self.around
        status = tracker.at(now, around.speeds())
        is_driven = around.driver() != 'nobody'
        self._motion.on_driven(is_driven, now)
        return Situation(
            status, self._trial, now - self._robot_seen <= _ROBOT_TIMEOUT,
            tracker.has_learner(now), tracker.has_controller(now), self.is_simulated,
            around.conflict(), is_driven, self._motion.is_stuck(now) and not status.held,
            self._motion.has_moved, around.tries_left(), self._has_waited(status.phase, now),
            tracker.learner_values.get('doing', ''), tracker.learner_values.get('ended', ''),
            len(tracker.teach_here), self.n_episodes,
            has_other_cells=around.has_other_cells())

    def _has_waited(self, phase: str, now: float) -> bool:
        """Return True if a phase of the learner lasts longer than it takes to look around."""
        if phase != self._phase:
            self._phase, self._phase_since = phase, now
        return now - self._phase_since > _LOOKING_AROUND

    @property
    def n_episodes(self) -> int:
        """Return how many bags the task has; 0 where nobody says."""
        said = self._tracker.learner_values.get('episodes', '')
        return int(said) if said.isdecimal() and len(said) < 8 else 0

    def _state(self, situation: Situation) -> dict[str, Any]:
        status, tracker = situation.status, self._tracker
        values = tracker.learner_values
        return {
            'task': values.get('task', '')[:100], 'simulation': situation.is_simulated,
            'phase': status.phase, 'seconds': int(status.seconds), 'bag': status.bag,
            'trial': trial_content(situation.trial),
            'trials_left': status.trials_left, 'tries_left': situation.tries_left,
            'prototypes': status.prototypes, 'basin': number_or_none(status.basin),
            'fidelity': number_or_none(status.fidelity), 'held': situation.held,
            'problem': status.problem, 'start': list(tracker.start) or None,
            'goal': self._shown.goal, 'teach_here': [list(place) for place in tracker.teach_here],
            'speeds': list(status.speeds), 'driver': self.around.driver(),
            'revision': _whole(values.get('revision', '')),
            'nodes': {'learner': situation.has_learner, 'controller': situation.has_controller,
                      'robot': situation.has_robot},
            'can_undo': values.get('can_undo') == 'true', 'episodes': situation.n_episodes,
            'advice': advice_for(situation).content()}


def trial_content(trial: TrialStatus) -> dict[str, Any]:
    """Return how a trial stands, for the page."""
    return {'number': trial.trial, 'state': str(trial.state), 'outcome': str(trial.outcome or ''),
            'reason': trial.reason, 'stop_reason': str(trial.stop_reason or ''),
            'steps': trial.steps, 'decisions': trial.decisions,
            'reinforcements': trial.reinforcements}


def number_or_none(value: float) -> float | None:
    """Return a number that JSON has; None where there is none."""
    return value if math.isfinite(value) else None


def _whole(text: str) -> int:
    return int(text) if text.isdecimal() and len(text) < 10 else -1
