"""What a trial has seen and done, as another workspace of the same lattice has it."""

import numpy as np

from control_field.grid import Grid
from control_field.kernels.decision import TrialState
from control_field.kernels.waiting import new_record, WayRecord
from control_field.local_grid import UNKNOWN
from control_field.windows import moved


def moved_state(state: TrialState, old: Grid, new: Grid) -> TrialState:
    """Return the state of a trial on another workspace; what is of its field has yet to come."""
    return state._replace(
        ground=state.ground._replace(known=moved(state.ground.known, old, new, UNKNOWN)),
        counts=moved(state.counts, old, new, 0), entered=moved(state.entered, old, new, 0),
        punished=moved(state.punished, old, new, 0), seen=moved(state.seen, old, new, False))


def moved_record(way: WayRecord, old: Grid, new: Grid) -> WayRecord:
    """Return the record of a way on another workspace; nothing is waited for there yet."""
    rows, cols = old.offset_to(new) or (0, 0)
    return new_record(moved(way.room, old, new, UNKNOWN))._replace(
        came=moved(way.came, old, new, False), counts=way.counts,
        glance=way.glance + np.array([rows, cols, 0]))
