"""A trial of any length in a bag: what the page is to replay as fast as a short one."""

from collections.abc import Iterator
import math
from pathlib import Path
from typing import Any, Final

import numpy as np
from rclpy.serialization import serialize_message

from control_field.grid import Grid
from control_field.headings import heading_from_vector
from control_field.records import CellFlag, ControlField, DECISION_DTYPE, Outcome, Prototypes
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.task_folder import episode_from_path, EpisodeFolder, EpisodeKind, TaskFolder
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose, stamp_from_seconds
from msgs_bridge.messages.tables import (
    cloud_from_decisions, cloud_from_field, cloud_from_prototypes)
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.messages.velocities import twist_stamped_from_velocity

#: As a robot's own: odometry and commands, local grids, [1/s]; its speed, [m/s].
RATE, GRIDS, SPEED = 50, 10, 0.2
#: Cells of the workspace and of a local grid along a side.
SIDE: Final = 200
LOCAL_GRID_SIDE: Final = 15
GRID: Final = Grid(SIDE, SIDE, 0.25)
_TYPES: Final = {
    'odom': 'nav_msgs/msg/Odometry', 'neighbourhood': 'nav_msgs/msg/OccupancyGrid',
    'cmd_vel': 'geometry_msgs/msg/TwistStamped',
    'cmd_vel_requested': 'geometry_msgs/msg/TwistStamped',
    'experience': 'sensor_msgs/msg/PointCloud2', 'trial': 'diagnostic_msgs/msg/DiagnosticStatus',
    'control_field': 'sensor_msgs/msg/PointCloud2', 'prototypes': 'sensor_msgs/msg/PointCloud2'}

_Said = Iterator[tuple[float, str, Any]]


def write_long_trial(bags: Path, task: str, seconds: float) -> EpisodeFolder:
    """Record a robot that drives round a circle for so long, decides and sees; return the bag."""
    header = EpisodeHeader(EpisodeKind.TRIAL, task, GRID).to_mapping()
    with start_bag(TaskFolder(bags, task), EpisodeKind.TRIAL, header) as bag:
        for stamp, topic, message in _messages(seconds):
            bag.write(f'/{topic}', _TYPES[topic], serialize_message(message), round(stamp * 1e9))
    return episode_from_path(bag.folder)


def _messages(seconds: float) -> _Said:
    field = _field()
    yield 1.0, 'control_field', cloud_from_field(field)
    yield 1.0, 'prototypes', cloud_from_prototypes(_prototypes(), GRID)
    yield 1.0, 'trial', status_from_trial(TrialStatus(State.RUNNING, 1, stamp=1.0))
    cell, n = None, 0
    for i in range(round(seconds * RATE) + 1):
        pose = _pose(1.0 + i / RATE)
        if i % (RATE // GRIDS) == 0:
            yield pose.stamp, 'neighbourhood', _local_grid(pose)
        yield pose.stamp, 'odom', odometry_from_pose(pose)
        here = GRID.cell_from_world(pose.x, pose.y)
        if here != cell:
            cell = here
            yield pose.stamp, 'experience', cloud_from_decisions(_decision(pose, here, n), GRID)
            n += 1
        for topic, v in (('cmd_vel_requested', SPEED), ('cmd_vel', SPEED * (i % 500 > 25))):
            yield pose.stamp, topic, twist_stamped_from_velocity(
                v, pose.w, stamp_from_seconds(pose.stamp))
    yield pose.stamp, 'trial', status_from_trial(TrialStatus(
        State.ENDED, 1, Outcome.GOAL, steps=n, decisions=n, stamp=pose.stamp))


def _pose(stamp: float) -> Pose:
    middle, radius = SIDE * GRID.resolution / 2.0, SIDE * GRID.resolution / 3.0
    turn = SPEED * (stamp - 1.0) / radius
    yaw = math.remainder(turn + math.pi / 2.0, math.tau)
    return Pose(stamp, middle + radius * math.cos(turn), middle + radius * math.sin(turn), yaw,
                SPEED, SPEED / radius, GRID.frame_id)


def _decision(pose: Pose, cell: tuple[int, int], n: int) -> Any:
    action = heading_from_vector(math.cos(pose.yaw), math.sin(pose.yaw))
    rows = np.zeros(1, dtype=DECISION_DTYPE)
    rows['stamp'], rows['trial'], rows['step'], rows['revision'] = pose.stamp, 1, n, 1
    rows['row'], rows['col'] = rows['next_row'], rows['next_col'] = cell
    rows['action'] = action
    return rows


def _local_grid(pose: Pose) -> Any:
    row, col = GRID.cell_from_world(pose.x, pose.y)
    cells = np.zeros((LOCAL_GRID_SIDE, LOCAL_GRID_SIDE), dtype=np.int8)
    cells[0], cells[:, 0] = 100, -1
    return grid_from_neighbourhood(
        Neighbourhood(pose.stamp, row, col, cells, GRID.frame_id), GRID)


def _field() -> ControlField:
    """Return a field that leads anywhere to a goal in the middle, between a few walls."""
    rows, cols = np.mgrid[:SIDE, :SIDE].astype(np.float32)
    vx, vy = SIDE / 2 - cols, SIDE / 2 - rows
    length = np.maximum(np.hypot(vx, vy), 1e-6)
    known = np.where((rows % 40 == 5) & (cols % 40 < 25), 100, 0).astype(np.int8)
    flags = np.full((SIDE, SIDE), CellFlag.SUPPORTED, dtype=np.uint8)
    return ControlField(
        GRID, 1, (SIDE // 2, SIDE // 2), vx / length, vy / length,
        np.ones((SIDE, SIDE), np.float32), np.zeros((SIDE, SIDE, 8), np.float32), known, flags)


def _prototypes() -> Prototypes:
    cells = np.argwhere(np.arange(SIDE * SIDE).reshape(SIDE, SIDE) % 41 == 0).astype(np.int32)
    n = len(cells)
    return Prototypes(
        cells, np.zeros(n, np.int8), np.ones(n), np.ones(n, np.int32), np.full(n, 2.0),
        np.ones(n, np.bool_))
