"""Trials: which one a bag is about, how it counts, and whether its robot has driven it."""

import numpy as np
import numpy.typing as npt

from control_field.presence import doubt_about_trial
from control_field.records import Outcome
from msgs_bridge.bag_records import RawMessages
from msgs_bridge.bag_tables import pose_table, statuses
from msgs_bridge.episode_header import EpisodeHeader
from msgs_bridge.trial_status import Label, State, TrialStatus


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
    ended: TrialStatus | None,
) -> str:
    """
    Say why a trial's decisions are none of the robot whose odometry lies beside them.

    Parameters
    ----------
    odometry : RawMessages
    header : EpisodeHeader
    rows : ndarray of DECISION_DTYPE
    ended : TrialStatus or None
        How it ended.

    """
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
