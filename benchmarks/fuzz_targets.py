"""What a fuzzer feeds bytes to: every decoder of messages, and every reader of bags."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
import tempfile
from typing import Any, Final

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan

from control_field.grid import Grid
from control_field.local_grid import BLOCKED, cells_from_fine, FREE
from control_field.records import ControlField, DECISION_DTYPE, Outcome, Prototypes
from episode_store.episode import Episode
from episode_store.header import EpisodeHeader
from episode_store.repair import repair_bag
from episode_store.rosbag2.columns import read_columns
from episode_store.rosbag2.errors import mcap_path
from episode_store.rosbag2.metadata import custom_data, with_note
from episode_store.rosbag2.reader import BagReader, RawMessages
from episode_store.rosbag2.topic_tables import (
    decision_table, local_grid_table, pose_table, statuses)
from episode_store.rosbag2.writer import BagWriter
from episode_store.task_folder import EpisodeKind
from msgs_bridge.messages.cdr import DESCRIBED, struct_from_cdr
from msgs_bridge.messages.neighbourhoods import (
    grid_from_neighbourhood, map_from_occupancy, Neighbourhood, neighbourhood_from_grid,
    occupancy_from_map)
from msgs_bridge.messages.poses import (
    initialpose_from_pose, odometry_from_pose, Pose, pose_from_initialpose, pose_from_odometry,
    pose_from_pose_stamped, pose_stamped_from_pose, variances_from_covariance)
from msgs_bridge.messages.tables import (
    cloud_from_decisions, cloud_from_field, cloud_from_prototypes, decisions_by_place,
    decisions_from_cloud, field_from_cloud, prototypes_from_cloud)
from msgs_bridge.messages.trial_status import (
    State, status_from_trial, trial_from_status, TrialStatus)
from msgs_bridge.messages.velocities import (
    twist_from_velocity, twist_stamped_from_velocity, velocity_from_twist)
from neighbourhood_node.neighbourhood import NeighbourhoodMaker
from neighbourhood_node.settings import NeighbourhoodSettings

GRID: Final = Grid(4, 5, 0.25)
_POSE: Final = Pose(1.0, 0.6, 0.4, 0.3, 0.1, 0.2, 'odom')
_NAME: Final = '0001_trial'
#: What the sample bag holds a message of each.
_CHANNELS: Final = (
    ('/odom', 'nav_msgs/msg/Odometry'), ('/experience', 'sensor_msgs/msg/PointCloud2'),
    ('/trial', 'diagnostic_msgs/msg/DiagnosticStatus'))
#: Longest error: others must not be able to fill a log.
_MAX_SENTENCE: Final = 1000
_NOTES: Final = b"""rosbag2_bagfile_information:
  version: 9
  custom_data:
    label: "success"
"""


@dataclass(frozen=True)
class Target:
    """
    Something that reads bytes from outside.

    Parameters
    ----------
    read : callable
        Gets the bytes. May raise ValueError (with it every error of the bridge), nothing else.
    seeds : tuple of bytes
        What it reads without an error: a fuzzer begins with these.

    """

    read: Callable[[bytes], Any]
    seeds: tuple[bytes, ...]

    def __call__(self, data: bytes) -> bool:
        """Feed bytes; tell whether they were accepted. Any other error comes through."""
        try:
            self.read(data)
        except ValueError as error:
            if '\n' in str(error) or len(str(error)) > _MAX_SENTENCE:
                raise AssertionError(f'no sentence: {error}') from error
            return False
        return True


def _reader(type_name: str, *readers: Callable[[Any], Any]) -> Callable[[bytes], None]:
    """Return what reads a message as a node gets it: ROS deserialises, the bridge decodes."""
    package, _, name = type_name.split('/')
    kind = getattr(import_module(f'{package}.msg'), name)

    def read(data: bytes) -> None:
        try:
            msg = deserialize_message(data, kind)
        except Exception as error:
            # What ROS itself does not deserialise never comes to a callback.
            raise ValueError('ROS refuses it') from error
        for reader in readers:
            reader(msg)

    return read


def _target(example: Any, *readers: Callable[[Any], Any]) -> Target:
    kind = type(example)
    type_name = f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
    return Target(_reader(type_name, *readers), (bytes(serialize_message(example)),))


def _field() -> ControlField:
    ones = np.ones(GRID.shape, np.float32)
    return ControlField(
        GRID, 1, (2, 3), ones, 0 * ones, ones, np.zeros((*GRID.shape, 8), np.float32),
        np.zeros(GRID.shape, np.int8), np.ones(GRID.shape, np.uint8))


def _prototypes() -> Prototypes:
    return Prototypes(
        np.array([[0, 1], [2, 2]], np.int32), np.array([0, 3], np.int8), np.array([0.5, -1.0]),
        np.array([1, -2], np.int32), np.array([1.5, np.nan]), np.array([True, False]))


def _decisions() -> Any:
    rows = np.zeros(2, DECISION_DTYPE)
    rows['trial'], rows['step'], rows['next_col'] = 1, (0, 1), 1
    return rows


def _scan() -> LaserScan:
    return LaserScan(
        header=odometry_from_pose(_POSE).header, angle_min=-1.0, angle_max=1.0,
        angle_increment=0.5, range_min=0.1, range_max=3.0, ranges=[0.2, 1.0, np.inf, np.nan, 9.0])


def _place(pose: Pose) -> None:
    GRID.cell_from_world(pose.x, pose.y)


def _see(source: str) -> Callable[[Any], None]:
    """Return what a neighbourhood is made of a message with."""
    maker = NeighbourhoodMaker(NeighbourhoodSettings(source=source, rows=4, cols=5))
    odometry = odometry_from_pose(_POSE)

    def see(msg: Any) -> None:
        maker.update(msg)
        maker.neighbourhood(odometry)

    return see


def _column_target(example: Any, *readers: Callable[[RawMessages], Any]) -> Target:
    """Return what reads raw messages of a bag: two of them, one as recorded and one spoilt."""
    package = type(example).__module__.split('.')[0]
    type_name = f'{package}/msg/{type(example).__name__}'
    whole = bytes(serialize_message(example))

    def read(data: bytes) -> None:
        messages = RawMessages.of('/topic', type_name, [whole, data, whole], [1, 2, 3])
        for reader in readers:
            reader(messages)
        struct_from_cdr(DESCRIBED[type_name], data)

    return Target(read, (whole,))


def _read_twist(messages: RawMessages) -> Any:
    return read_columns(messages, {'vx': 1, 'wz': 1})


class _BagBytes:
    """A bag's file that is written and read again and again."""

    def __init__(self) -> None:
        self._root = tempfile.TemporaryDirectory(prefix='fuzz_')
        self.folder = Path(self._root.name) / _NAME
        self.folder.mkdir()
        self.path = mcap_path(self.folder)

    def put(self, data: bytes) -> Path:
        """Write the file; whatever else lay in the folder is gone."""
        for path in self.folder.iterdir():
            path.unlink()
        self.path.write_bytes(data)
        return self.folder

    def sample(self) -> bytes:
        """Return the bytes of a small trial."""
        self.put(b'')
        self.path.unlink()
        header = EpisodeHeader(EpisodeKind.TRIAL, 'task', GRID).to_mapping()
        messages = (odometry_from_pose(_POSE), cloud_from_decisions(_decisions(), GRID),
                    status_from_trial(TrialStatus(State.ENDED, 1, Outcome.GOAL)))
        with BagWriter(self.folder, header) as bag:
            for (topic, kind), message in zip(_CHANNELS, messages, strict=True):
                bag.write(topic, kind, bytes(serialize_message(message)), 1)
        return self.path.read_bytes()


def _bag_target(*readers: Callable[[Path], Any]) -> Target:
    """Return what reads a whole file, each reader for itself."""
    file = _BagBytes()

    def read(data: bytes) -> None:
        refusals = []
        for reader in readers:
            folder = file.put(data)
            try:
                reader(folder)
            except ValueError as error:
                refusals.append(error)
        if refusals:
            raise refusals[0]

    whole = file.sample()
    return Target(read, (whole, whole[:-200], whole[:len(whole) // 2]))


def _read_all(folder: Path) -> None:
    for _ in BagReader(mcap_path(folder)).records():
        pass


def _mend_and_read(folder: Path) -> None:
    """Check that a mended file is whole, and holds what could be trusted before."""
    before = _counts(BagReader(mcap_path(folder), verify=True))
    repair_bag(folder)
    reader = BagReader(mcap_path(folder))
    after = _counts(reader)
    # A channel whose own name or type was hit is left out.
    kept = {channel: n for channel, n in before.items() if channel in _CHANNELS}
    if reader.damage or not kept.items() <= after.items() or not after.items() <= before.items():
        raise AssertionError(f'mended: {reader.damage or "whole"}, {before} -> {after} messages')


def _counts(reader: BagReader) -> Counter[tuple[str, str]]:
    """Count messages by topic and type."""
    return Counter((record[0].topic, record[0].schema.name) for record in reader.records())


def _read_notes(data: bytes) -> None:
    text = data.decode('utf-8', 'replace')
    custom_data(text)
    with_note(text, 'label', 'success', 'metadata.yaml')


def _wide() -> Neighbourhood:
    """Return a neighbourhood of 5x5 cells, each of 3x3 finer ones."""
    fine = np.full((15, 15), FREE, np.int8)
    fine[0, :4] = BLOCKED
    return Neighbourhood(1.0, 1, 2, cells_from_fine(fine, 3), 'odom', fine)


def targets() -> dict[str, Target]:
    """Return every target by its name."""
    neighbourhood = Neighbourhood(1.0, 1, 2, np.full((3, 3), FREE, np.int8), 'odom')
    local_grid, odometry = grid_from_neighbourhood(neighbourhood, GRID), odometry_from_pose(_POSE)
    wide = grid_from_neighbourhood(_wide(), GRID)
    occupancy = map_from_occupancy(np.zeros(GRID.shape, np.int8), GRID)
    placed, clicked = initialpose_from_pose(_POSE), pose_stamped_from_pose(_POSE)
    status = status_from_trial(TrialStatus(State.ENDED, 1, Outcome.GOAL))
    field, rows = cloud_from_field(_field()), cloud_from_decisions(_decisions(), GRID)
    return {
        'field': _target(field, field_from_cloud),
        'prototypes': _target(cloud_from_prototypes(_prototypes(), GRID), prototypes_from_cloud),
        'decisions': _target(rows, decisions_from_cloud,
                             lambda msg: decisions_from_cloud(msg, GRID),
                             lambda msg: decisions_by_place(msg, GRID)),
        'odometry': _target(odometry, lambda msg: _place(pose_from_odometry(msg))),
        'goal_pose': _target(clicked, lambda msg: _place(pose_from_pose_stamped(msg))),
        'initialpose': _target(placed, lambda msg: _place(pose_from_initialpose(msg)), lambda msg:
                               variances_from_covariance(msg.pose.covariance, 'initialpose')),
        'twist': _target(twist_from_velocity(0.1, 0.2), velocity_from_twist),
        'twist_stamped': _target(twist_stamped_from_velocity(
            0.1, 0.2, odometry.header.stamp, 'base'), velocity_from_twist),
        'neighbourhood': _target(local_grid, lambda msg: neighbourhood_from_grid(msg, GRID)),
        'wide_neighbourhood': _target(wide, lambda msg: neighbourhood_from_grid(msg, GRID)),
        'map': _target(occupancy, occupancy_from_map),
        'status': _target(status, trial_from_status),
        'scan': _target(_scan(), _see('scan')),
        'costmap': _target(occupancy, _see('costmap')),
        'raw_odometry': _column_target(odometry, lambda raw: pose_table(raw, 'odom')),
        'raw_pose': _column_target(clicked, lambda raw: pose_table(raw, 'odom')),
        'raw_placed': _column_target(placed, lambda raw: pose_table(raw, 'odom')),
        'raw_sight': _column_target(local_grid, lambda raw: local_grid_table(raw, GRID),
                                    lambda raw: local_grid_table(raw, GRID, fitted=True)),
        'raw_wide': _column_target(wide, lambda raw: local_grid_table(raw, GRID)),
        'raw_decisions': _column_target(rows, lambda raw: decision_table(raw, GRID),
                                        lambda raw: decision_table(raw, GRID, fitted=True)),
        'raw_status': _column_target(status, lambda raw: list(statuses(raw))),
        'raw_twist': _column_target(twist_from_velocity(0.1, 0.2), _read_twist),
        'bag': _bag_target(_read_all, lambda folder: Episode.at(folder).content),
        'mended_bag': _bag_target(_mend_and_read),
        'notes': Target(_read_notes, (_NOTES,)),
    }
