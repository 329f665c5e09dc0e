"""
Driving from cell to cell: when to decide, and along which segments to go.

In the open the robot heads for the next centre and decides shortly before it arrives. Beside
anything occupied it keeps to the lines between the centres: a turn is made on the centre.
"""

import math
from typing import Final

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW
from control_field.robot.limits import Limits, Velocity
from control_field.robot.steering import EXACT_CONE, Segment, steer, wrapped
from control_field_node.seen import Seen
from msgs_bridge.messages.poses import Pose

#: How near a centre the robot turns in tight places, in cells; also where it rests at the goal.
EXACT: Final = 0.05

#: How far from its centre a cell is driven through at most, in cells: it must not be mistaken
#: for the next one.
MOST_ASIDE: Final = 0.35

Cell = tuple[int, int]
_STEPS: Final = tuple(zip(STEP_ROW.tolist(), STEP_COL.tolist(), strict=True))


class Drive:
    """
    Where the robot is on its way.

    Parameters
    ----------
    grid : Grid
        The workspace.
    limits : Limits
        What the robot can do.
    tolerance : float
        How far before a centre the next step is decided, in cells.
    corner_cutting : bool
        Whether a diagonal step may pass a occupied cell beside it.
    clearance : float, [m]
        How far from a centre, away from what is occupied, the robot drives; less than half a cell.

    """

    def __init__(
        self, grid: Grid, limits: Limits, tolerance: float, corner_cutting: bool = False,
        clearance: float = 0.0,
    ) -> None:
        """Start somewhere, on the way to nowhere."""
        self.grid = grid
        self.limits = limits
        self.tolerance = tolerance
        self.corner_cutting = corner_cutting
        self.clearance = min(clearance, MOST_ASIDE * grid.resolution)
        self.reset()

    def reset(self) -> None:
        """Forget the way; the next `is_due` begins from where the robot is."""
        self._segments: list[Segment] = []
        self._target: Cell = (-1, -1)
        self._source: Cell = (-1, -1)
        self._reach = 0.0
        self._occupied: frozenset[Cell] = frozenset()

    def is_due(self, pose: Pose, seen: Seen) -> bool:
        """Tell whether the robot has come to where the next step is decided."""
        cell = self.grid.cell_from_world(pose.x, pose.y)
        self._look(seen)
        if not self._segments:
            self._begin(pose, cell, seen)
        elif self._is_occupied(cell, seen) or _apart(cell, self._target) > 1:
            self.to_centre(pose)
        elif seen.is_tight and not self._segments[-1].exact:
            end = self._segments[-1]
            self._segments = [Segment(pose.x, pose.y, end.bx, end.by, True)]
        while len(self._segments) > 1 and self._left(pose) <= EXACT * self.grid.resolution:
            del self._segments[0]
        return (cell == self._target == (seen.row, seen.col) and len(self._segments) == 1
                and self._left(pose) <= self._reach)

    def go(self, heading: int, pose: Pose, seen: Seen) -> None:
        """Set out for the neighbour in a heading of the cell where the step was decided."""
        row, col = seen.row, seen.col
        step = _STEPS[heading]
        x, y = self._middle((row, col))
        end = self._middle((row + step[0], col + step[1]))
        line = Segment(x, y, *end, seen.is_tight)
        if not seen.is_tight:
            self._segments = [Segment(pose.x, pose.y, *end, False)]
        elif self._is_on(line, pose):
            self._segments = [line]
        else:
            self._segments = [self._to(x, y, pose), line]
        self._source, self._target = (row, col), (row + step[0], col + step[1])
        self._reach = self.tolerance * self.grid.resolution

    def to_centre(self, pose: Pose) -> None:
        """Drive to the centre of the robot's own cell, exactly."""
        cell = self.grid.cell_from_world(pose.x, pose.y)
        self._segments = [self._to(*self._middle(cell), pose)]
        self._source = self._target = cell
        self._reach = EXACT * self.grid.resolution

    def velocity(self, pose: Pose) -> Velocity:
        """Return the velocity along the present segment."""
        return steer(pose.x, pose.y, pose.yaw, self._segments[0], self.limits)

    def _look(self, seen: Seen) -> None:
        """Keep aside of what has come into sight."""
        news = seen.occupied != self._occupied
        self._occupied = seen.occupied
        if news and self.clearance and self._segments:
            end = self._segments[-1]
            self._segments[-1] = Segment(end.ax, end.ay, *self._middle(self._target), end.exact)

    def _middle(self, cell: Cell) -> tuple[float, float]:
        """Return where to drive in a cell: its centre, or aside of it, away from the occupied."""
        x, y = self.grid.world_from_cell(*cell)
        if not self.clearance:
            return x, y
        near = [(row - cell[0], col - cell[1]) for row, col in self._occupied
                if _apart((row, col), cell) == 1]
        return (x + self.clearance * _away([col for _, col in near]),
                y + self.clearance * _away([row for row, _ in near]))

    def _begin(self, pose: Pose, cell: Cell, seen: Seen) -> None:
        """Go on from anywhere; in the open there is no need to find the centre first."""
        self.to_centre(pose)
        if not seen.is_tight:
            self._reach = math.inf

    def _to(self, x: float, y: float, pose: Pose) -> Segment:
        """Return the exact segment to a point, along the present one if it leads there."""
        last = self._segments[-1] if self._segments else None
        if last is not None and last.exact and (last.bx, last.by) == (x, y):
            return last
        return Segment(pose.x, pose.y, x, y, True)

    def _left(self, pose: Pose) -> float:
        return self._segments[0].remaining(pose.x, pose.y)

    def _is_on(self, line: Segment, pose: Pose) -> bool:
        """Tell whether the robot can go on along a line without turning on its beginning."""
        if line.remaining(pose.x, pose.y) > (1.0 + self.tolerance) * math.hypot(
                line.bx - line.ax, line.by - line.ay):
            return False
        return (abs(line.lateral(pose.x, pose.y)) <= EXACT * self.grid.resolution
                and (abs(wrapped(line.heading() - pose.yaw)) < EXACT_CONE
                     or self._is_at(line.ax, line.ay, pose)))

    def _is_at(self, x: float, y: float, pose: Pose) -> bool:
        return math.hypot(x - pose.x, y - pose.y) <= EXACT * self.grid.resolution

    def _is_occupied(self, cell: Cell, seen: Seen) -> bool:
        """Tell whether the local grid bars the step under way."""
        source, target = self._source, self._target
        if cell == target or source == target:
            return False
        if target in seen.occupied:
            return True
        if self.corner_cutting or source[0] == target[0] or source[1] == target[1]:
            return False
        return (source[0], target[1]) in seen.occupied or (target[0], source[1]) in seen.occupied


def _away(sides: list[int]) -> int:
    """Return which side is free when something is occupied on the other one only, else 0."""
    return (min(sides, default=0) < 0) - (max(sides, default=0) > 0)


def _apart(first: Cell, second: Cell) -> int:
    return max(abs(first[0] - second[0]), abs(first[1] - second[1]))
