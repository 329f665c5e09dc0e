"""A control field by hand, for tests of who follows it: straight to the goal over open ground."""

import numpy as np

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.records import CellFlag, ControlField

#: The workspace of the simulator's worlds.
GRID = Grid(20, 20, 0.25)


def octile(rows: np.ndarray, cols: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    """Return the length of the shortest way over open ground, in cells."""
    near, far = np.sort(np.abs([rows - goal[0], cols - goal[1]]), axis=0)
    return far + (np.sqrt(2.0) - 1.0) * near


def straight_field(
    goal: tuple[int, int], revision: int = 1, grid: Grid = GRID, discount: float = 0.98,
) -> ControlField:
    """Return the field whose course is the straight line, with the Q-matrix that goes with it."""
    rows, cols = np.indices(grid.shape)
    ahead = np.stack([goal[1] - cols, goal[0] - rows]).astype(float)
    length = np.hypot(*ahead)
    vx, vy = (ahead / np.where(length > 0.0, length, 1.0)).astype(np.float32)
    q = np.stack([
        discount ** (STEP_LENGTH[h] + octile(rows + STEP_ROW[h], cols + STEP_COL[h], goal))
        for h in range(8)], axis=2).astype(np.float32)
    flags = np.full(grid.shape, CellFlag.SUPPORTED, np.uint8)
    flags[goal] |= CellFlag.GOAL
    return ControlField(
        grid, revision, goal, vx, vy, (length > 0.0).astype(np.float32), q,
        np.full(grid.shape, -1, np.int8), flags)
