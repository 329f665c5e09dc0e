"""
Tracking the path from cell to cell: when to decide, and along which segments to drive.

In the open the robot heads for the next centre and decides shortly before it arrives. Beside
occupied cells it keeps to the lines between the centres, and turns on the centre.
"""

import math
from typing import Final

from control_field.grid import Grid
from control_field.headings import heading_from_step, STEP_COL, STEP_ROW
from control_field.robot.limits import Limits, Velocity
from control_field.robot.steering import EXACT_CONE, Segment, steer, wrapped
from control_field_node.inputs.observation import Observation
from msgs_bridge.messages.poses import Pose

#: How near a centre the robot turns in tight places, and stops at the goal, [cells].
EXACT: Final = 0.05

#: A body with corners finds a centre by so much at least, [m].
_LEAST_EXACT: Final = 0.01

#: Greatest distance from a centre at which its cell is passed, [cells]: the robot must not be
#: taken to be in the next cell.
MAX_OFFSET: Final = 0.35

Cell = tuple[int, int]
_STEPS: Final = tuple(zip(STEP_ROW.tolist(), STEP_COL.tolist(), strict=True))


class PathTracker:
    """
    Tracks the segments to the next cell, and knows when the next step is to be decided.

    Parameters
    ----------
    grid : Grid
        The workspace.
    limits : Limits
        What the robot can do.
    tolerance : float
        How far before a centre the next step is decided, [cells].
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell beside it.
    clearance : float, [m]
        How far off a centre, away from occupied cells, the robot drives; less than half a cell.

    """

    def __init__(
        self, grid: Grid, limits: Limits, tolerance: float, corner_cutting: bool = False,
        clearance: float = 0.0,
    ) -> None:
        """Start without a target."""
        self.grid = grid
        self.limits = limits
        self.tolerance = tolerance
        self.corner_cutting = corner_cutting
        self.clearance = min(clearance, MAX_OFFSET * grid.resolution)
        self._exact = exactness(grid, limits)
        self.reset()

    def reset(self) -> None:
        """Forget the segments; the next `update` begins from where the robot is."""
        self._segments: list[Segment] = []
        self._target: Cell = (-1, -1)
        self._source: Cell = (-1, -1)
        self._reach = 0.0
        self._occupied: frozenset[Cell] = frozenset()

    def update(self, pose: Pose, observation: Observation) -> None:
        """Adjust the segments to where the robot is and to what it observes."""
        cell = self.grid.cell_from_world(pose.x, pose.y)
        self._avoid(observation)
        if not self._segments:
            self.approach_centre(pose)
            if not observation.is_tight:  # in the open the centre need not be found first
                self._reach = math.inf
        elif self._is_blocked(cell, observation) or _apart(cell, self._target) > 1:
            self.approach_centre(pose)
        elif observation.is_tight and not self._segments[-1].exact:
            end = self._segments[-1]
            self._segments = [Segment(pose.x, pose.y, end.bx, end.by, True)]
        while len(self._segments) > 1 and self._remaining(pose) <= self._exact:
            del self._segments[0]

    def is_due(self, pose: Pose, observation: Observation) -> bool:
        """Return whether the robot is where the next step is decided; call `update` before."""
        cell = self.grid.cell_from_world(pose.x, pose.y)
        return (cell == self._target == observation.cell and len(self._segments) == 1
                and self._remaining(pose) <= self._reach)

    def step_under_way(self, pose: Pose) -> tuple[Cell, int] | None:
        """Return cell and heading of the step under way; None where the next cell is reached."""
        (row, col), target = self._source, self._target
        if target in ((row, col), self.grid.cell_from_world(pose.x, pose.y)):
            return None
        return (row, col), heading_from_step(target[0] - row, target[1] - col)

    def start_step(self, heading: int, pose: Pose, observation: Observation) -> None:
        """Set out for the neighbour in a heading of the cell where the step was decided."""
        row, col = observation.cell
        d_row, d_col = _STEPS[heading]
        x, y = self._waypoint((row, col))
        end = self._waypoint((row + d_row, col + d_col))
        line = Segment(x, y, *end, observation.is_tight)
        if not observation.is_tight:
            self._segments = [Segment(pose.x, pose.y, *end, False)]
        elif self._is_on(line, pose):
            self._segments = [line]
        else:
            self._segments = [self._segment_to(x, y, pose), line]
        self._source, self._target = (row, col), (row + d_row, col + d_col)
        self._reach = self.tolerance * self.grid.resolution

    def approach_centre(self, pose: Pose) -> None:
        """Drive to the centre of the robot's own cell, exactly."""
        cell = self.grid.cell_from_world(pose.x, pose.y)
        self._segments = [self._segment_to(*self._waypoint(cell), pose)]
        self._source = self._target = cell
        self._reach = self._exact

    def velocity(self, pose: Pose) -> Velocity:
        """Return the velocity along the present segment."""
        return steer(pose.x, pose.y, pose.yaw, self._segments[0], self.limits)

    def _avoid(self, observation: Observation) -> None:
        """Move the end of the last segment off newly observed occupied cells."""
        is_new = observation.occupied != self._occupied
        self._occupied = observation.occupied
        if is_new and self.clearance and self._segments:
            end = self._segments[-1]
            self._segments[-1] = Segment(
                end.ax, end.ay, *self._waypoint(self._target), end.exact)

    def _waypoint(self, cell: Cell) -> tuple[float, float]:
        """Return where to pass a cell: its centre, or off it, away from occupied cells."""
        x, y = self.grid.world_from_cell(*cell)
        if not self.clearance:
            return x, y
        near = [(row - cell[0], col - cell[1]) for row, col in self._occupied
                if _apart((row, col), cell) == 1]
        return (x + self.clearance * _away([col for _, col in near]),
                y + self.clearance * _away([row for row, _ in near]))

    def _segment_to(self, x: float, y: float, pose: Pose) -> Segment:
        """Return the exact segment to a point, along the present one if it leads there."""
        last = self._segments[-1] if self._segments else None
        if last is not None and last.exact and (last.bx, last.by) == (x, y):
            return last
        return Segment(pose.x, pose.y, x, y, True)

    def _remaining(self, pose: Pose) -> float:
        return self._segments[0].remaining(pose.x, pose.y)

    def _is_on(self, line: Segment, pose: Pose) -> bool:
        """Return whether the robot can follow a line without turning at its beginning first."""
        if line.remaining(pose.x, pose.y) > (1.0 + self.tolerance) * math.hypot(
                line.bx - line.ax, line.by - line.ay):
            return False
        return (abs(line.lateral(pose.x, pose.y)) <= self._exact
                and (abs(wrapped(line.heading() - pose.yaw)) < EXACT_CONE
                     or self._is_at(line.ax, line.ay, pose)))

    def _is_at(self, x: float, y: float, pose: Pose) -> bool:
        return math.hypot(x - pose.x, y - pose.y) <= self._exact

    def _is_blocked(self, cell: Cell, observation: Observation) -> bool:
        """Return whether an occupied cell blocks the step under way."""
        source, target = self._source, self._target
        if cell == target or source == target:
            return False
        if target in observation.occupied:
            return True
        if self.corner_cutting or source[0] == target[0] or source[1] == target[1]:
            return False
        corners = (source[0], target[1]), (target[0], source[1])
        return not observation.occupied.isdisjoint(corners)


def exactness(grid: Grid, limits: Limits) -> float:
    """
    Return how near a centre the robot turns in tight places, and how near a line it sets out, [m].

    A body with corners turns where they have room. Where they never have, it need not be on the
    line before it sets out, as it could not turn to come there.
    """
    usual, half = EXACT * grid.resolution, 0.5 * grid.resolution
    if limits.footprint is None:
        return usual
    room = half - limits.footprint.circumscribed
    if room > 0.0:
        return min(usual, max(0.5 * room, _LEAST_EXACT))
    return max(usual, 0.5 * (half - limits.footprint.inscribed))


def _away(sides: list[int]) -> int:
    """Return which side is free, -1 or 1, when only the other one is occupied; else 0."""
    return (min(sides, default=0) < 0) - (max(sides, default=0) > 0)


def _apart(first: Cell, second: Cell) -> int:
    return max(abs(first[0] - second[0]), abs(first[1] - second[1]))
