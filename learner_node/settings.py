"""Parameters of the learner beside those of learning: task, workspace, trials."""

from dataclasses import dataclass
import math
from typing import Any, Final

from control_field.drives.plausibility import SPEED_MAX
from control_field.grid import Grid
from control_field.parameters import check_fields, parameter
from control_field.poses import StartPose
from episode_store.task_folder import check_task_name
from msgs_bridge.node.workspace_settings import check_workspace, set_workspace

#: Settings that the memory or the topics are made from: they hold from start to end.
FIXED: Final = (
    'bags', 'fresh', 'frame_id', 'rows', 'cols', 'resolution', 'origin_x', 'origin_y',
    'robot_radius', 'simulation', 'lockstep', 'enable_stamped_cmd_vel', 'controller')


@dataclass(frozen=True)
class Settings:
    """
    Settings of the learner; see the metadata of each field for unit, range and meaning.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names it.

    """

    task: str = parameter(
        'task', "name of the task, its bags' folder: letters, digits, _ and -; it may become "
        'another one while nothing is under way')
    bags: str = parameter('bags', "folder of all tasks' bags: the robot's memory")
    new_task: bool = parameter(
        False, 'begin a task also where its name is nearly that of another one with bags')
    fresh: bool = parameter(
        False, 'begin without the bags that are there; they are set aside, and ~/undo brings them '
        'back')
    frame_id: str = parameter('odom', 'frame of the workspace')
    rows: int = parameter(
        0, 'rows of a workspace that is set; 0: it fits itself, and grows with what is driven and '
        'seen', unit='cells', low=0, high=2000)
    cols: int = parameter(0, 'its columns, likewise', unit='cells', low=0, high=2000)
    resolution: float = parameter(
        0.0, 'side of a cell; 0: that of the bags and of the neighbourhood, else by robot_radius',
        unit='m', low=0.0, high=100.0)
    origin_x: float = parameter(
        0.0, 'x of the lower left corner of a workspace that is set', unit='m', low=-1e7,
        high=1e7)
    origin_y: float = parameter(0.0, 'y of that corner', unit='m', low=-1e7, high=1e7)
    robot_radius: float = parameter(
        0.105, 'radius of the body: a cell is the smallest multiple of 0.05 m that holds it with '
        '2 cm to spare on each side', unit='m', low=0.0, high=10.0)
    simulation: bool = parameter(
        False, 'the robot is a simulated one that initialpose may set back')
    lockstep: bool = parameter(
        False, 'the simulator waits for its answers; bags are stamped with its time')
    enable_stamped_cmd_vel: bool = parameter(
        False, 'record cmd_vel as TwistStamped instead of Twist (always in lock-step)')
    controller: str = parameter('control_field_node', 'name of the controller node')
    auto_trials: int = parameter(
        6, 'trials that ~/run_trials runs', unit='trials', low=1, high=1_000_000)
    auto_start: bool = parameter(
        False, 'run trials without being asked until the task has auto_trials of them '
        '(simulation only)')
    starts: str = parameter(
        'fixed', 'fixed: start_poses in turn, or where the demonstrations started; spread: where '
        'a trial teaches most', choices=('fixed', 'spread'))
    speed_max: float = parameter(
        SPEED_MAX, 'a demonstration that is faster is not learnt: no robot of this kind drives so',
        unit='m/s', low=0.01, high=100.0)
    peer_timeout: float = parameter(
        5.0, 'time without odometry, or without an answer of the controller, after which a trial '
        'is aborted', unit='s', low=0.5, high=600.0)
    teacher_timeout: float = parameter(
        10.0, 'time without teleop_heartbeat and commands, the robot standing, after which the '
        'recording of a demonstration ends; only where the heartbeat was heard before', unit='s',
        low=1.0, high=86400.0)

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)
        check_workspace(self)
        check_task_name(self.task)
        if self.auto_start and not self.simulation:
            raise ValueError('auto_start is true, which needs simulation: true (a real robot '
                             'starts when a person says so)')

    @property
    def grid(self) -> Grid | None:
        """Return the workspace; None where it fits itself."""
        return set_workspace(self)

    @property
    def is_stamped(self) -> bool:
        """Whether cmd_vel is a TwistStamped."""
        return self.lockstep or self.enable_stamped_cmd_vel


def start_poses_from_list(values: Any, grid: Grid | None) -> tuple[StartPose, ...]:
    """
    Return the poses of a flat list ``x, y, yaw, x, y, yaw, ...``.

    Raises
    ------
    ValueError
        If it is no such list, or a pose lies outside a workspace that is set.

    """
    numbers = [float(value) for value in values or ()]
    if len(numbers) % 3:
        raise ValueError(f'start_poses has {len(numbers)} numbers, must be x, y, yaw each')
    poses = tuple(StartPose(*numbers[i:i + 3]) for i in range(0, len(numbers), 3))
    for pose in poses:
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise ValueError(f'start_poses: ({pose.x}, {pose.y}, {pose.yaw}) is not finite')
        if grid is not None and not grid.contains(*grid.cell_from_world(pose.x, pose.y)):
            raise ValueError(f'start_poses: ({pose.x:g}, {pose.y:g}) m lies outside the workspace '
                             f'of {grid.size}')
    return poses
