"""The node `neighbourhood_node`: the 3x3 local grid of a robot that has a laser or a costmap."""

from collections import deque
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import LaserScan

from control_field.robot.stop_rules import Timeout
from control_field.robot.suspension import Suspension
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood
from msgs_bridge.node import qos
from msgs_bridge.node.command_line import check_names, names_of, Program
from msgs_bridge.node.node_info import workspace_from_grid
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.node.ros_parameters import declare_parameters_from
from msgs_bridge.node.run import run_node
from msgs_bridge.node.throttled_log import ThrottledLog
from neighbourhood_node.laser_mount_finder import LaserMountFinder
from neighbourhood_node.neighbourhood import NeighbourhoodMaker
from neighbourhood_node.settings import FIXED, NeighbourhoodSettings

_DIAGNOSTICS_PERIOD: Final = 1.0
#: Time without odometry after which none arrives, [s].
_SILENCE: Final = 2.0

PROGRAM: Final = Program(
    'neighbourhood_node', 'makes the local grid of a robot from its laser scan or a costmap.',
    '-p source:=costmap -r costmap:=local_costmap/costmap', names_of(NeighbourhoodSettings))

#: Number of costmaps recognised when they come through another subscription.
_N_RECENT: Final = 8


class NeighbourhoodNode(Node):
    """
    Publishes `neighbourhood` for every `odom`, from `scan` or `costmap`.

    The stamp is the odometry's, the cells are those of the workspace. What is stale or was never
    seen is unknown. Every parameter is described in `neighbourhood_node.settings`.

    Raises
    ------
    ValueError
        If a parameter is wrong: one line that names it.

    """

    def __init__(self, **options: Any) -> None:
        """Declare, subscribe, wait."""
        super().__init__('neighbourhood_node', **options)
        self._maker = NeighbourhoodMaker(declare_parameters_from(
            self, NeighbourhoodSettings, fixed=FIXED, on_change=self._on_settings))
        check_names(self)
        self._throttled_log = ThrottledLog(self)
        self._neighbourhoods = qos.create_quiet_publisher(
            self, OccupancyGrid, 'neighbourhood', qos.SENSOR)
        #: Hashes of the last messages: several subscriptions get the same costmap.
        self._recent: deque[int] = deque(maxlen=_N_RECENT)
        self._mount_finder: LaserMountFinder | None = None
        if self._maker.settings.source == 'scan':
            self._mount_finder = LaserMountFinder(self, self._maker)
            self.create_subscription(LaserScan, 'scan', self._on_local_grid, qos.SENSOR)
        else:
            qos.subscribe_all(
                self, OccupancyGrid, 'costmap', self._on_costmap, qos.COSTMAPS, raw=True)
        self.create_subscription(Odometry, 'odom', self._on_odometry, qos.SENSOR)
        self._problem, self._suspension = '', Suspension(_SILENCE)
        self._odometry = Timeout(_SILENCE, self._suspension)
        self._peers = PeerMonitor(self, 'sight')
        if not self._maker.settings.follows:
            self._peers.describe(workspace_from_grid(
                self._maker.grid, is_fitted=not self._maker.settings.is_bounded))
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(_DIAGNOSTICS_PERIOD, self._publish_diagnostics,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._log_topics()

    def _log_topics(self) -> None:
        settings, named = self._maker.settings, self.resolve_topic_name
        logger, grid = self.get_logger(), self._maker.grid  # type: ignore[no-untyped-call]
        x, y = grid.world_from_cell(0, 0)
        where = str(grid) if settings.is_bounded else (
            f'cells of {grid.resolution:g} m in {grid.frame_id!r}, without bounds; the centre of '
            f'one is ({x:g}, {y:g})')
        logger.info(
            f'{named("neighbourhood")} is made from {named(settings.source)} and {named("odom")}, '
            f'in {where}')

    def _publish_diagnostics(self) -> None:
        """Publish the diagnostics, and log once where the laser is mounted."""
        if self._mount_finder is not None:
            self._mount_finder.log()
        cells = self._peers.cells('learner', 'robot')
        if cells is not None and self._maker.follow(cells):
            self._log_topics()
        now = time.monotonic()
        self._suspension.look(now)
        problem = self._problem
        if self._odometry.is_stale(now):
            problem = f'nothing is published: {self._odometry.absence(now, "odometry")}'
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if problem else DiagnosticStatus.OK,
            name=f'{self.get_fully_qualified_name().lstrip("/")}: local grid',
            message=problem or 'all well', hardware_id='sight',
            values=[KeyValue(key='refused', value=str(self._throttled_log.n_refused))])
        self._peers.add_to(status)
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def _on_settings(self, settings: NeighbourhoodSettings) -> None:
        self._maker.settings = settings

    def _on_costmap(self, raw: bytes) -> None:
        """Take in a costmap, unless another subscription got it already."""
        mark = hash(raw)
        if mark not in self._recent:
            self._recent.append(mark)
            self._on_local_grid(deserialize_message(raw, OccupancyGrid))

    def _on_local_grid(self, msg: Any) -> None:
        if self._mount_finder is not None:
            self._mount_finder.on_frames(laser=msg.header.frame_id)
        try:
            self._maker.update(msg)
        except ValueError as error:
            self._maker.refusal = str(error)
            self._throttled_log.log_refused(error)

    def _on_odometry(self, msg: Odometry) -> None:
        now = time.monotonic()
        if self._mount_finder is not None:
            self._mount_finder.on_frames(base=msg.child_frame_id)
        try:
            neighbourhood = self._maker.neighbourhood(msg)
        except ValueError as error:
            self._odometry.pass_over(now, str(error))
            self._throttled_log.log_refused(error)
            return
        self._odometry.on_arrival(now)
        self._neighbourhoods.publish(grid_from_neighbourhood(neighbourhood, self._maker.grid))
        self._problem = self._maker.problem(neighbourhood.stamp)
        self._throttled_log.log_missing(
            self._problem,
            f'{self._maker.settings.source} has come, all is well', self._maker.has_seen)


def main(args: list[str] | None = None) -> None:
    """
    Run the node until SIGINT or SIGTERM.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong.

    """
    run_node(PROGRAM, NeighbourhoodNode, args)


if __name__ == '__main__':
    main()
