"""Trials: which one a bag is about, how it counts, and whether its robot has driven it."""

from typing import Final

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import place_text
from control_field.drives.presence import doubt_about_trial
from control_field.grid import Grid
from control_field.records import Kind, Outcome
from control_field.words import counted
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.reader import RawMessages
from episode_store.rosbag2.topic_tables import pose_table, statuses
from msgs_bridge.messages.raw_cloud import cloud_from_cdr
from msgs_bridge.messages.tables import goal_from_cloud
from msgs_bridge.messages.trial_status import Label, State, TrialStatus

#: A robot that slipped may have come to the goal from a step into a cell beside it.
_BESIDE: Final = 1


def own_trial(
    messages: RawMessages, rows: npt.NDArray[np.void],
) -> tuple[int, TrialStatus | None]:
    """
    Return the number of the trial that a bag is about, and how it ended.

    Statuses are latched and no decision is dropped: a bag may begin with those of the trial
    before it, which may even have the same number if the controller was started anew.
    """
    running = next(((i, status.trial) for i, status in statuses(messages)
                    if status.state is State.RUNNING), None)
    if running is not None:
        since, number = running
    elif len(rows):
        since, number = -1, int(rows['trial'][-1])
    else:
        since, number = -1, next((status.trial for _, status in statuses(messages, True)
                                  if status.state is State.ENDED), 0)
    return number, next((status for i, status in statuses(messages, True) if i > since
                         and status.state is State.ENDED and status.trial == number), None)


def judged(outcome: Outcome, label: Label) -> Outcome:
    """
    Return how a trial counts as having ended, once a person has judged it.

    A failure counts as given up, even at the goal; a success as the goal, wherever it ended. What
    was broken off stays so: its record is not to be trusted.
    """
    if outcome is Outcome.ABORTED or label is Label.NONE:
        return outcome
    if label is Label.SUCCESS:
        return Outcome.GOAL
    return outcome if outcome is Outcome.COLLISION else Outcome.GAVE_UP


def doubt_about(
    odometry: RawMessages, header: EpisodeHeader, rows: npt.NDArray[np.void],
    ended: TrialStatus | None, fields: RawMessages,
) -> str:
    """
    Say why a trial was not driven as its decisions say, by the robot whose odometry lies beside.

    Parameters
    ----------
    odometry : RawMessages
    header : EpisodeHeader
    rows : ndarray of DECISION_DTYPE
    ended : TrialStatus or None
        How it ended.
    fields : RawMessages
        What it drove by.

    """
    # Those of older versions say neither whose field it was nor all of the rest.
    if header.memory and ended is not None and (
            doubt := _doubt_about_record(rows, ended, header, fields)):
        return doubt
    poses = pose_table(odometry, header.grid.frame_id)
    if not len(poses.stamps) and (len(odometry) or 'odom' not in header.topics):
        return ''  # in a frame of its own, or never recorded: nothing to compare with
    claimed = rows
    if (len(rows) and ended is not None and ended.outcome is Outcome.GOAL
            and ended.stamp > rows['stamp'][-1]):  # old statuses have no stamp
        claimed = np.concatenate([rows, rows[-1:]])
        for name, value in (('row', rows['next_row'][-1]), ('col', rows['next_col'][-1]),
                            ('stamp', ended.stamp)):
            claimed[name][-1] = value
    return doubt_about_trial(claimed, poses.stamps, poses.xy, header.grid, header.speed_max)


def _doubt_about_record(
    rows: npt.NDArray[np.void], ended: TrialStatus, header: EpisodeHeader, fields: RawMessages,
) -> str:
    """Say why decisions and end are not those of one trial of one controller."""
    if len(rows) > ended.decisions:
        return (f'{counted(len(rows), "decision")} came, and the controller made '
                f'{ended.decisions} of them: somebody else publishes experience or trial')
    moved = rows[rows['kind'] != Kind.BLOCKED]
    steps = moved['step'].astype(np.int64)
    # The controller numbers what a person drives once it is done, what it decides before.
    again = np.flatnonzero(np.diff(2 * steps + (moved['kind'] != Kind.TAUGHT)) <= 0)
    if len(again):
        return (f'step {steps[again[0] + 1]} comes after step {steps[again[0]]}: somebody else '
                f'publishes experience')
    return _doubt_about_goal(rows, header.grid, fields) if (
        ended.outcome is Outcome.GOAL and len(rows)) else ''


def _doubt_about_goal(
    rows: npt.NDArray[np.void], grid: Grid, fields: RawMessages,
) -> str:
    """Say that a trial did not end where its field leads to, or in a cell beside it."""
    goals = [goal for message in fields if (goal := _goal(message, grid))]
    ends = int(rows['next_row'][-1]), int(rows['next_col'][-1])
    if not goals or any(max(abs(ends[0] - row), abs(ends[1] - col)) <= _BESIDE
                        for row, col in goals):
        return ''
    there, where = (place_text(grid.world_from_cell(*cell)) for cell in (ends, goals[-1]))
    return (f'it is said to have reached the goal at {where}, and its last step leads to {there}: '
            f'somebody else publishes trial')


def _goal(message: bytes, grid: Grid) -> tuple[int, int] | None:
    """Return the cell of the grid that the goal of a field lies in."""
    try:
        place = goal_from_cloud(cloud_from_cdr(message))
        return None if place is None else grid.cell_from_world(*place)
    except ValueError:
        return None
