"""Rules in a second, plainer form, for tests to compare the code with."""

import numpy as np

from control_field.headings import N_HEADINGS, STEP_COL, STEP_ROW
from control_field.local_grid import BLOCKED, UNKNOWN


def neighbourhood_from_masks(blocked, unknown):
    """Unpack two bytes into a neighbourhood; the robot's own cell is free."""
    neighbourhood = np.zeros((3, 3), dtype=np.int8)
    for heading in range(N_HEADINGS):
        place = 1 + STEP_ROW[heading], 1 + STEP_COL[heading]
        if blocked >> heading & 1:
            neighbourhood[place] = BLOCKED
        elif unknown >> heading & 1:
            neighbourhood[place] = UNKNOWN
    return neighbourhood


def allowed_from_blocked(blocked, corner_cutting=False):
    """Return the mask of steps that a robot with a body, or a point, may take."""
    allowed = ~blocked & 0xFF
    if not corner_cutting:
        for heading in range(1, N_HEADINGS, 2):
            beside = 1 << (heading - 1) | 1 << (heading + 1) % N_HEADINGS
            if blocked & beside:
                allowed &= ~(1 << heading)
    return allowed


def turn_between(first, second):
    """Return the number of eighths of a turn (0 to 4) between two headings."""
    apart = (first - second) % N_HEADINGS
    return min(apart, N_HEADINGS - apart)
