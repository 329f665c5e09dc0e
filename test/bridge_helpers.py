"""Strategies and small bags for the tests of msgs_bridge."""

from collections.abc import Callable
from importlib import import_module
import math
from pathlib import Path
import subprocess
import sys
from typing import Any

from hypothesis import strategies as st
import numpy as np
from rclpy.serialization import serialize_message

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW
from control_field.local_grid import cells_from_fine
from control_field.records import CellFlag, ControlField, DECISION_DTYPE, Outcome, Prototypes
from episode_store.episode import Content, Episode
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.rosbag2.writer import BagWriter
from episode_store.task_folder import EpisodeKind, TaskFolder
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import cloud_from_decisions
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.messages.velocities import twist_from_velocity
from msgs_bridge.node.environment import child_environment

GRID = Grid(20, 20, 0.25)
STATUS = 'diagnostic_msgs/msg/DiagnosticStatus'
ODOMETRY = 'nav_msgs/msg/Odometry'
OCCUPANCY = 'nav_msgs/msg/OccupancyGrid'
CLOUD = 'sensor_msgs/msg/PointCloud2'
TWIST = 'geometry_msgs/msg/Twist'

coordinates = st.floats(-1e4, 1e4)
grids = st.builds(
    Grid, n_rows=st.integers(1, 9), n_cols=st.integers(1, 9),
    resolution=st.sampled_from([0.05, 0.25, 1.0, 1 / 3]) | st.floats(0.01, 10.0),
    origin_x=coordinates, origin_y=coordinates, frame_id=st.sampled_from(['odom', 'map']))
poses = st.builds(
    Pose, stamp=st.floats(0.0, 2e9), x=coordinates, y=coordinates,
    yaw=st.floats(-math.pi + 1e-9, math.pi), v=st.floats(-9, 9), w=st.floats(-9, 9),
    frame_id=st.sampled_from(['odom', 'map', 'wörld']))


def random_field(grid: Grid, seed: int) -> ControlField:
    """Return a field of random courses, Q-values, map and flags."""
    rng = np.random.default_rng(seed)
    turn = rng.uniform(-np.pi, np.pi, grid.shape)
    length = rng.integers(0, 2, grid.shape)
    goal = int(rng.integers(grid.n_rows)), int(rng.integers(grid.n_cols))
    flags = rng.choice([0, 1, 2, 3, 8, 11], grid.shape).astype(np.uint8)
    flags[goal] |= CellFlag.GOAL
    return ControlField(
        grid=grid, revision=int(rng.integers(2**32)), goal=goal,
        vx=(length * np.cos(turn)).astype(np.float32),
        vy=(length * np.sin(turn)).astype(np.float32),
        coherence=rng.uniform(0, 1, grid.shape).astype(np.float32),
        q=rng.normal(size=(*grid.shape, 8)).astype(np.float32),
        known=rng.choice([0, 100, -1], grid.shape).astype(np.int8), flags=flags)


def random_prototypes(grid: Grid, seed: int) -> Prototypes:
    """Return prototypes in a random share of the cells, perhaps none."""
    rng = np.random.default_rng(seed)
    cells = np.argwhere(rng.uniform(size=grid.shape) < rng.uniform()).astype(np.int32)
    n = len(cells)
    return Prototypes(
        cells=cells, headings=rng.integers(0, 8, n).astype(np.int8), q=rng.normal(size=n),
        episodes=rng.integers(-9, 9, n).astype(np.int32),
        stamps=np.where(rng.uniform(size=n) < 0.5, np.nan, rng.uniform(0, 2e9, n)),
        demonstrated=rng.uniform(size=n) < 0.5)


def random_decisions(grid: Grid, n: int, seed: int, trial: int = 1) -> np.ndarray:
    """Return decisions whose steps stay in the workspace."""
    rng = np.random.default_rng(seed)
    rows = np.zeros(n, dtype=DECISION_DTYPE)
    rows['trial'], rows['step'], rows['stamp'] = trial, np.arange(n), rng.uniform(0, 1e6, n)
    rows['row'], rows['col'] = rng.integers(grid.n_rows, size=n), rng.integers(grid.n_cols, size=n)
    rows['action'] = rng.integers(0, 8, n)
    rows['next_row'] = np.clip(rows['row'] + STEP_ROW[rows['action']], 0, grid.n_rows - 1)
    rows['next_col'] = np.clip(rows['col'] + STEP_COL[rows['action']], 0, grid.n_cols - 1)
    rows['reward'], rows['kind'] = rng.integers(-1, 2, n), rng.integers(0, 5, n)
    rows['blocked'], rows['unknown'] = rng.integers(0, 256, n), rng.integers(0, 256, n)
    return rows


def raw_status(state: State, trial: int = 0, outcome: Outcome | None = None, **more: Any) -> bytes:
    """Return a serialised `trial` status."""
    return serialize_message(status_from_trial(TrialStatus(state, trial, outcome, **more)))


def raw_decisions(rows: np.ndarray, grid: Grid = GRID) -> bytes:
    """Return a serialised `experience` message."""
    return serialize_message(cloud_from_decisions(rows, grid))


def raw_odometry(stamp: float, x: float, y: float, frame_id: str = 'odom') -> bytes:
    """Return a serialised `odom` message."""
    return serialize_message(odometry_from_pose(Pose(stamp, x, y, 0.3, 0.1, 0.2, frame_id)))


def raw_local_grid(
    stamp: float, row: int, col: int, cells: np.ndarray, grid: Grid = GRID, k: int = 1,
) -> bytes:
    """Return a serialised `neighbourhood` message; ``cells`` are k a side of one of the grid's."""
    fine = cells.astype(np.int8)
    return serialize_message(grid_from_neighbourhood(Neighbourhood(
        stamp, row, col, cells_from_fine(fine, k), grid.frame_id, fine if k > 1 else None), grid))


def spoil(msg: Any, name: str, value: Any) -> None:
    """Set a value deep in a message, such as ``info.origin.position.x``."""
    *path, last = name.split('.')
    for part in path:
        msg = getattr(msg, part)
    setattr(msg, last, value)


def message_class(type_name: str) -> Any:
    """Return the class of a message type such as ``nav_msgs/msg/Odometry``."""
    package, _, name = type_name.split('/')
    return getattr(import_module(f'{package}.msg'), name)


def refusal(call: Callable[[], Any], kind: type[ValueError] = ValueError) -> str:
    """Return why a call refuses, empty if it does not; any other error comes through."""
    try:
        call()
    except kind as error:
        return str(error)
    return ''


def nanoseconds(stamp: float) -> int:
    """Return a log time for a stamp."""
    return round(stamp * 1e9)


def write_drive(bag: BagWriter, n: int = 200, rate: float = 20.0) -> None:
    """Write a straight drive with local grids and commands into a bag."""
    for i in range(n):
        stamp = i / rate
        x, y = 0.5 + 0.2 * stamp, 0.6 + 0.1 * stamp
        row, col = GRID.cell_from_world(x, y)
        log_time = nanoseconds(stamp)
        bag.write('/neighbourhood', OCCUPANCY,
                  raw_local_grid(stamp, row, col, np.zeros((3, 3))), log_time)
        bag.write('/odom', ODOMETRY, raw_odometry(stamp, x, y), log_time)
        bag.write('/cmd_vel', TWIST, serialize_message(twist_from_velocity(0.2, 0.0)), log_time)


def demonstration_bag(root: Path, n: int = 200, rate: float = 20.0) -> Path:
    """Record a demonstration that was kept; return its folder."""
    header = EpisodeHeader(EpisodeKind.DEMO, 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(root, 'task1'), EpisodeKind.DEMO, header) as bag:
        bag.write('/trial', STATUS, raw_status(State.RUNNING), 0)
        write_drive(bag, n, rate)
        bag.write('/trial', STATUS, raw_status(State.ENDED, 0, Outcome.GOAL),
                  nanoseconds(n / rate))
    return bag.folder


def content_of(folder: Path) -> Content:
    """Return what the bag in a folder teaches."""
    return Episode.at(folder).content


#: Cells of a drive that ends where it began.
LOOP = [(2, 2), (2, 3), (2, 4), (3, 4), (4, 4), (4, 3), (4, 2), (3, 2), (2, 2)]


def loop_bag(root: Path, cells: list[tuple[int, int]] = LOOP) -> Path:
    """Record a demonstration through the centres of some cells that was kept."""
    header = EpisodeHeader(EpisodeKind.DEMO, 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(root, 'task1'), EpisodeKind.DEMO, header) as bag:
        for i, (row, col) in enumerate(cells):
            bag.write('/odom', ODOMETRY, raw_odometry(i, *GRID.world_from_cell(row, col)),
                      nanoseconds(i))
    return bag.folder


def trial_bag(root: Path, write: Callable[[BagWriter], None]) -> Path:
    """Record a trial; return its folder."""
    header = EpisodeHeader(EpisodeKind.TRIAL, 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(root, 'task1'), EpisodeKind.TRIAL, header) as bag:
        write(bag)
    return bag.folder


def run_python(code: str, *arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run code in a process of its own that finds these packages."""
    tests = str(Path(__file__).parent)
    environment = child_environment()
    environment['PYTHONPATH'] = f'{environment["PYTHONPATH"]}:{tests}'
    return subprocess.run(
        [sys.executable, '-c', code, *arguments], env=environment, text=True,
        capture_output=True, timeout=60, check=False, **options)
