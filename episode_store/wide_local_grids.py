"""Local grids that show more than the cells around the robot: which of a bag's count."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.records import no_local_grids
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.reader import RawMessages
from episode_store.rosbag2.topic_tables import local_grid_table, LocalGridTable
from msgs_bridge.messages.cdr import CdrError, layout_from_cdr, OCCUPANCY_GRID

#: Seconds that stamps of local grids may step back before a clock that jumped is assumed.
CLOCK_JUMP: Final = 1.0
#: What is seen so long before its first decision belongs to a trial, [s].
_BEFORE: Final = 1.0
#: So old and so many messages back may the local grid be that a decision was made by, [s].
_SOON, _N_BACK = 0.5, 16
#: Cells of a local grid that shows the robot's and the eight around it.
_NINE: Final = 9


def in_order(stamps: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Return the order of local grids by stamp since the clock last jumped back."""
    jumps = np.flatnonzero(np.diff(stamps) < -CLOCK_JUMP)
    n_before = int(jumps[-1]) + 1 if len(jumps) else 0
    return np.asarray(n_before + np.argsort(stamps[n_before:], kind='stable'), dtype=np.int64)


def trial_local_grids(
    messages: RawMessages, header: EpisodeHeader, decisions: npt.NDArray[np.void], end: float,
) -> npt.NDArray[np.void]:
    """
    Return the wide local grids of a trial, as far as the robot was where they were seen.

    A controller that corrects odometry decides in other cells than those of the local grids that
    were recorded. So what is seen after a decision counts only if that was made by one of the
    local grids of just before: in its cell, with its masks.

    Parameters
    ----------
    messages : RawMessages
        Of `neighbourhood`.
    header : EpisodeHeader
    decisions : ndarray of DECISION_DTYPE, shape (n,)
        Of the trial, in order.
    end : float, [s]
        Stamp of its end.

    Returns
    -------
    ndarray of `local_grid_dtype`, shape (m,)
        By stamp.

    """
    if not len(decisions) or not _may_be_wide(messages):
        return no_local_grids()
    table = local_grid_table(messages, header.grid, header.fitted)
    wide = table.local_grids[in_order(table.local_grids['stamp'])]
    stamps = np.maximum.accumulate(decisions['stamp'])
    wide = wide[(wide['stamp'] >= stamps[0] - _BEFORE) & (wide['stamp'] <= end)]
    if not len(wide):
        return no_local_grids()
    made = np.maximum(np.searchsorted(stamps, wide['stamp'], side='right') - 1, 0)
    return np.asarray(wide[_are_of_their_cells(table, decisions)[made]])


def _may_be_wide(messages: RawMessages) -> bool:
    """Return False if the longest message shows nine cells, as most bags' do."""
    if not len(messages) or messages.type_name != 'nav_msgs/msg/OccupancyGrid':
        return False
    try:
        layout = layout_from_cdr(OCCUPANCY_GRID, messages[int(np.argmax(messages.sizes))])
    except CdrError:
        return True
    return layout.places['data'].n > _NINE


def _are_of_their_cells(
    table: LocalGridTable, decisions: npt.NDArray[np.void],
) -> npt.NDArray[np.bool_]:
    """Return which decisions were made by a local grid of just before, shape (n,)."""
    order = in_order(table.stamps)
    newest = np.searchsorted(table.stamps[order], decisions['stamp'] + 1e-9, side='right') - 1
    found = np.zeros(len(decisions), dtype=np.bool_)
    for back in range(_N_BACK):
        row = order[np.maximum(newest - back, 0)]
        found |= ((newest >= back) & (decisions['stamp'] - table.stamps[row] <= _SOON)
                  & (table.cells[row, 0] == decisions['row'])
                  & (table.cells[row, 1] == decisions['col'])
                  & (table.blocked[row] == decisions['blocked'])
                  & (table.unknown[row] == decisions['unknown']))
    return found
