"""The node `neighbourhood_node`: the 3x3 sight of a robot that has a laser or a costmap."""

from contextlib import suppress
import sys
from typing import Any, Final, NoReturn

from nav_msgs.msg import OccupancyGrid, Odometry
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown
from sensor_msgs.msg import LaserScan

from msgs_bridge import qos
from msgs_bridge.neighbourhood_maker import NeighbourhoodMaker
from msgs_bridge.neighbourhoods import grid_from_neighbourhood
from msgs_bridge.parameters import declare_parameters_from
from msgs_bridge.processes import prepare
from msgs_bridge.sight_settings import FIXED, SightSettings

_LOG_PERIOD: Final = 10.0


class NeighbourhoodNode(Node):
    """
    Publishes `neighbourhood` for every `odom`, from `scan` or `costmap`.

    The stamp is the odometry's, the cells are those of the workspace. What is stale or was never
    seen is unknown. Every parameter is described in `msgs_bridge.sight_settings`.

    Raises
    ------
    ValueError
        If a parameter is wrong: one line that names it.

    """

    def __init__(self, **options: Any) -> None:
        """Declare, subscribe, wait."""
        super().__init__('neighbourhood_node', **options)
        self._maker = NeighbourhoodMaker(declare_parameters_from(
            self, SightSettings, fixed=FIXED, on_change=self._on_settings))
        self._neighbourhoods = self.create_publisher(OccupancyGrid, 'neighbourhood', qos.SENSOR)
        scans = self._maker.settings.source == 'scan'
        self.create_subscription(
            LaserScan if scans else OccupancyGrid, 'scan' if scans else 'costmap', self._on_sight,
            qos.SENSOR)
        self.create_subscription(Odometry, 'odom', self._on_odometry, qos.SENSOR)

    def _on_settings(self, settings: SightSettings) -> None:
        self._maker.settings = settings

    def _on_sight(self, msg: Any) -> None:
        try:
            self._maker.saw(msg)
        except ValueError as error:
            self._warn(f'refused: {error}')

    def _on_odometry(self, msg: Odometry) -> None:
        try:
            neighbourhood = self._maker.neighbourhood(msg)
        except ValueError as error:
            self._warn(f'refused: {error}')
            return
        self._neighbourhoods.publish(grid_from_neighbourhood(neighbourhood, self._maker.grid))
        problem = self._maker.problem(neighbourhood.stamp)
        if problem:
            self._stale(problem)

    def _warn(self, text: str) -> None:
        logger = self.get_logger()  # type: ignore[no-untyped-call]
        logger.warning(text, throttle_duration_sec=_LOG_PERIOD)

    def _stale(self, text: str) -> None:
        # The throttle is one of a line of source: what is refused must not hide what is stale.
        logger = self.get_logger()  # type: ignore[no-untyped-call]
        logger.warning(text, throttle_duration_sec=_LOG_PERIOD)


def main(args: list[str] | None = None) -> None:
    """
    Run the node until SIGINT or SIGTERM.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong.

    """
    prepare()
    try:
        _init(args)
        rclpy.spin(_make_node())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        # A signal invalidates whatever is being made or published at that moment: no error.
        if ok():
            raise
    finally:
        with suppress(rcl.RCLError):  # the signal's own shutdown may be under way
            try_shutdown()


def _init(args: list[str] | None) -> None:
    try:
        rclpy.init(args=args)
    except (rcl.RCLError, rcl.UnknownROSArgsError) as error:
        _exit_with(f'wrong ROS arguments: {str(error).split(", at /")[0]}')


def _make_node() -> NeighbourhoodNode:
    try:
        return NeighbourhoodNode()
    except ValueError as error:
        _exit_with(str(error))


def _exit_with(problem: str) -> NoReturn:
    print('neighbourhood_node:', ' '.join(problem.split()), file=sys.stderr)
    raise SystemExit(2)


if __name__ == '__main__':
    main()
