"""Bags as other recorders leave them, of made-up drives; for `foreign_drives`."""

from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from benchmarks.broken_drives import Poses

SECOND: Final = 1_000_000_000
_TF: Final = 'tf2_msgs/msg/TFMessage'
#: A file of a bag that is split holds so many messages.
_SPLIT: Final = 300


class BagWriter:
    """
    Writes what robots publish.

    Parameters
    ----------
    path : Path
    storage : str
        ``mcap``, ``sqlite3``, ``ros1``, or ``split`` in files of MCAP.

    """

    def __init__(self, path: Path, storage: str = 'mcap') -> None:
        self._path, self._storage, self._n = path, storage, 0
        self._is_old = storage == 'ros1'
        self._store: Any = get_typestore(Stores.ROS1_NOETIC if self._is_old else Stores.ROS2_JAZZY)
        if self._is_old:
            self._store.register(get_types_from_msg(
                'geometry_msgs/TransformStamped[] transforms', _TF))
        self._writers: list[Any] = []
        self._topics: dict[str, Any] = {}

    def __enter__(self) -> 'BagWriter':
        """Open it."""
        self._open()
        return self

    def __exit__(self, *error: object) -> None:
        """Close it; the files of one that is split come into one folder."""
        self._writers[-1].close()
        if self._storage == 'split':
            self._path.mkdir()
            for number in range(len(self._writers)):
                part = self._path.with_name(f'part{number}')
                [file] = part.glob('*.mcap')
                file.rename(self._path / f'drive_{number}.mcap')

    def _open(self) -> None:
        if self._storage == 'split':
            path = self._path.with_name(f'part{len(self._writers)}')
        else:
            path = self._path
        if self._is_old:
            self._writers.append(Ros1Writer(path))
        else:
            self._writers.append(Writer(path, version=9, storage_plugin=(
                StoragePlugin.SQLITE3 if self._storage == 'sqlite3' else StoragePlugin.MCAP)))
        self._topics.clear()
        self._writers[-1].open()

    def _make(self, name: str, *values: Any) -> Any:
        package, _, kind = name.partition('/')
        return self._store.types[f'{package}/msg/{kind}'](*values)

    def _header(self, stamp: float, frame: str) -> Any:
        ns = round(stamp * SECOND)
        time = self._make('builtin_interfaces/Time', ns // SECOND, ns % SECOND)
        return self._make('std_msgs/Header', *([7] if self._is_old else []), time, frame)

    def _write(self, topic: str, kind: str, at: float, msg: Any) -> None:
        self._n += 1
        if self._storage == 'split' and self._n % _SPLIT == 0:
            self._writers[-1].close()
            self._open()
        if topic not in self._topics:
            self._topics[topic] = self._writers[-1].add_connection(
                topic, kind, typestore=self._store)
        serialize = self._store.serialize_ros1 if self._is_old else self._store.serialize_cdr
        self._writers[-1].write(self._topics[topic], round(at * SECOND), serialize(msg, kind))

    def _pose(self, x: float, y: float, z: float, yaw: float, axes: tuple[int, int, int]) -> Any:
        turn = np.zeros(3)
        place = np.array([x, y, z])[list(axes)]
        turn[axes.index(2)] = np.sin(yaw / 2.0)
        return self._make(
            'geometry_msgs/Pose', self._make('geometry_msgs/Point', *place.tolist()),
            self._make('geometry_msgs/Quaternion', *turn.tolist(), float(np.cos(yaw / 2.0))))

    def odometry(
        self, poses: Poses, topic: str = '/odom', frame: str = 'odom', is_stamped: bool = True,
        wall: float = 0.0, axes: tuple[int, int, int] = (0, 1, 2),
        z: npt.NDArray[np.float64] | None = None,
    ) -> None:
        """Write Odometry; ``axes`` are those of x, y, z; recorded at stamp + ``wall`` [s]."""
        first = poses.stamps[0]
        for i, (at, (x, y), yaw, (ahead, left, turning)) in enumerate(zip(
                poses.stamps.tolist(), poses.xy.tolist(), poses.yaw.tolist(),
                poses.velocity.tolist(), strict=True)):
            vectors = [self._make('geometry_msgs/Vector3', *each) for each in (
                (ahead, left, 0.0), (0.0, 0.0, turning))]
            self._write(topic, 'nav_msgs/msg/Odometry', max(at, first) + wall, self._make(
                'nav_msgs/Odometry', self._header(at * is_stamped, frame), 'base_link',
                self._make('geometry_msgs/PoseWithCovariance', self._pose(
                    x, y, 0.0 if z is None else float(z[i]), yaw, axes), np.zeros(36)),
                self._make('geometry_msgs/TwistWithCovariance', self._make(
                    'geometry_msgs/Twist', *vectors), np.zeros(36))))

    def poses(
        self, poses: Poses, kind: str, topic: str, frame: str, is_stamped: bool = True,
        z: npt.NDArray[np.float64] | None = None, has_headings: bool = True,
    ) -> None:
        """Write PoseStamped or PoseWithCovarianceStamped."""
        for i, (at, (x, y), yaw) in enumerate(zip(
                poses.stamps.tolist(), poses.xy.tolist(), poses.yaw.tolist(), strict=True)):
            pose = self._pose(x, y, 0.0 if z is None else float(z[i]), yaw, (0, 1, 2))
            if not has_headings:
                pose.orientation.z = pose.orientation.w = 0.0
            if kind == 'PoseWithCovarianceStamped':
                pose = self._make('geometry_msgs/PoseWithCovariance', pose, np.zeros(36))
            self._write(topic, f'geometry_msgs/msg/{kind}', at, self._make(
                f'geometry_msgs/{kind}', self._header(at * is_stamped, frame), pose))

    def transforms(self, parent: str, child: str, poses: Poses) -> None:
        """Write where a frame is in another one."""
        for at, (x, y), yaw in zip(
                poses.stamps.tolist(), poses.xy.tolist(), poses.yaw.tolist(), strict=True):
            self.transform(parent, child, at, x, y, yaw)

    def transform(
        self, parent: str, child: str, at: float, x: float, y: float, yaw: float,
    ) -> None:
        """Write one transform."""
        pose = self._pose(x, y, 0.0, yaw, (0, 1, 2))
        self._write('/tf', _TF, at, self._store.types[_TF]([self._make(
            'geometry_msgs/TransformStamped', self._header(at, parent), child, self._make(
                'geometry_msgs/Transform', self._make('geometry_msgs/Vector3', x, y, 0.0),
                pose.orientation))]))

    def commands(self, n: int) -> None:
        """Write commands to drive."""
        zero = self._make('geometry_msgs/Vector3', 0.0, 0.0, 0.0)
        for i in range(n):
            self._write('/cmd_vel', 'geometry_msgs/msg/Twist', 100.0 + i, self._make(
                'geometry_msgs/Twist', zero, zero))
