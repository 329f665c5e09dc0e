"""When the drive of a demonstration begins: what lies before it is no part of the drive."""

import math
from typing import Final

import numpy as np

from episode_store.rosbag2.columns import Columns, read_columns
from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.cdr import DESCRIBED

#: Nearer to where it was first, [m] and [rad], the robot has not moved; a command below these
#: speeds, [m/s] and [rad/s], moves none. The noise of wheels is far below both.
_STEP: Final = 0.005
_TURN: Final = 0.02
#: Types that a robot's place, and what it is told to do, are recorded as.
_PLACES: Final = 'nav_msgs/msg/Odometry'
_COMMANDS: Final = ('geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped')


def first_move(odometry: RawMessages, *commands: RawMessages) -> float:
    """
    Return the stamp until which the robot surely stood where it was first seen.

    Parameters
    ----------
    odometry : RawMessages
    *commands : RawMessages
        What the robot was told to do. One that moves it ends its stand, also where no odometry
        shows that: it is what is missing.

    Returns
    -------
    float, [s]
        Of the last odometry before the robot moved; -inf where it may have moved before the first
        or nothing is known.

    """
    if not len(odometry) or odometry.type_name != _PLACES:
        return -math.inf
    columns = read_columns(odometry, dict.fromkeys(
        ('sec', 'nanosec', 'x', 'y', 'qz', 'qw', 'vx', 'vy', 'wz'), 1))
    kept = columns.accepted
    if not kept.any():
        return -math.inf
    stands = _stands(columns)[kept]
    stands &= odometry.log_times[kept] < min(map(_first_order, commands), default=math.inf)
    n_standing = len(stands) if stands.all() else int(stands.argmin())
    stamps = (columns.values['sec'] + columns.values['nanosec'] * 1e-9)[kept]
    # One alone shows no stand where odometry tells of no speeds.
    return float(stamps[n_standing - 1]) if n_standing > 1 else -math.inf


def _stands(columns: Columns) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return for each odometry whether the robot still stands where it was first."""
    values = columns.values
    first = int(np.flatnonzero(columns.accepted)[0])
    with np.errstate(invalid='ignore', over='ignore'):
        way = np.hypot(values['x'] - values['x'][first], values['y'] - values['y'][first])
        yaw = 2.0 * np.arctan2(values['qz'], values['qw'])
        turn = np.abs(np.remainder(yaw - yaw[first] + np.pi, 2.0 * np.pi) - np.pi)
        speed = np.hypot(values['vx'], values['vy'])
        return np.asarray((way <= _STEP) & (turn <= _TURN) & (speed <= _STEP) & (
            np.abs(values['wz']) <= _TURN))


def _first_order(commands: RawMessages) -> float:
    """Return when the robot was first told to move, [ns] of the recorder's clock."""
    if commands.type_name not in _COMMANDS or commands.type_name not in DESCRIBED:
        return math.inf
    columns = read_columns(commands, dict.fromkeys(('vx', 'vy', 'wz'), 1))
    values = columns.values
    moves = columns.accepted & ((np.hypot(values['vx'], values['vy']) > _STEP) | (
        np.abs(values['wz']) > _TURN))
    return float(commands.log_times[moves][0]) if moves.any() else math.inf
