"""The node `localised_odometry_node`: odometry in the frame of a localisation's map."""

from contextlib import suppress
import time
from typing import Any, Final

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from control_field.robot.stop_rules import Timeout
from control_field.robot.suspension import Suspension
from localised_odometry_node.fusion import FIXED, is_tf, LocalisedOdometry, LocalisedSettings
from msgs_bridge.messages.poses import (
    odometry_from_pose, pose_from_initialpose, pose_from_odometry)
from msgs_bridge.node import qos
from msgs_bridge.node.command_line import check_names, names_of, Program
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.node.ros_parameters import declare_parameters_from
from msgs_bridge.node.run import run_node
from msgs_bridge.node.tf_type import transforms_type
from msgs_bridge.node.throttled_log import ThrottledLog
from msgs_bridge.sensing.live_frames import LiveFrames

_LOOK_PERIOD: Final = 1.0
#: Time without odometry after which none arrives, [s].
_SILENCE: Final = 2.0

PROGRAM: Final = Program(
    'localised_odometry_node', 'carries odometry to where a localisation sees the robot.',
    '-p pose_topic:=amcl_pose -p frame_id:=map', names_of(LocalisedSettings))


class LocalisedOdometryNode(Node):
    """
    Publishes `localised_odom` for every `odom`, as soon as `pose_topic` tells where the robot is.

    Stamp, speeds and covariances are the odometry's. Every parameter is described in
    `localised_odometry_node.fusion`.

    Raises
    ------
    ValueError
        If a parameter is wrong: one line that names it.

    """

    def __init__(self, **options: Any) -> None:
        """Declare, subscribe, wait."""
        super().__init__('localised_odometry_node', **options)
        settings = declare_parameters_from(
            self, LocalisedSettings, fixed=FIXED, on_change=self._on_settings)
        check_names(self)
        self._peers = PeerMonitor(self)
        self._localised = LocalisedOdometry(settings)
        self._throttled_log = ThrottledLog(self)
        self._suspension = Suspension(_SILENCE)
        self._odometry = Timeout(_SILENCE, self._suspension)
        self._publisher = self.create_publisher(Odometry, 'localised_odom', qos.ODOMETRY_PUB)
        self.create_subscription(Odometry, 'odom', self._on_odometry, qos.SENSOR)
        self._frames, self._n_leaps = LiveFrames(settings.pose_topic), 0
        self._subscribe(settings.pose_topic)
        self.create_timer(_LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        logger, named = self.get_logger(), self.resolve_topic_name  # type: ignore[no-untyped-call]
        logger.info(f'{named("localised_odom")} is made from {named("odom")} and '
                    f'{named(settings.pose_topic)}, in {settings.frame_id}')

    def _subscribe(self, topic: str) -> None:
        if not is_tf(topic):
            qos.subscribe_all(
                self, PoseWithCovarianceStamped, topic, self._on_pose, qos.LOCALISATIONS)
            return
        kind = transforms_type()
        if kind is None:
            raise ValueError(f'pose_topic is {topic!r}, which takes tf2_msgs (a ROS installation '
                             f'has it): name a topic of poses instead, such as amcl_pose')
        self.create_subscription(kind, topic, self._on_transforms, qos.FRAMES, raw=True)
        self.create_subscription(
            kind, f'{topic}_static', self._on_transforms, qos.STATIC_FRAMES, raw=True)

    def _on_transforms(self, message: bytes) -> None:
        try:
            told = self._frames.update(message)
            # Most of them are about wheels and sensors.
            if not self._frames.above(self._localised.odometry_frame).isdisjoint(told):
                self._take_origin()
        except ValueError as error:
            self._localised.pose_refusal = str(error)
            self._throttled_log.log_refused(error)

    def _take_origin(self) -> None:
        """Take where odometry begins in the map from the transforms; ValueError if it is odd."""
        localised = self._localised
        if not localised.odometry_frame:
            return
        found = self._frames.origin(localised.odometry_frame, localised.settings.frame_id)
        if found is not None:
            localised.on_origin(*found)
            localised.pose_refusal = ''

    def _on_settings(self, settings: LocalisedSettings) -> None:
        self._localised.settings = settings

    def _on_pose(self, msg: PoseWithCovarianceStamped) -> None:
        try:
            self._localised.on_pose(
                pose_from_initialpose(msg, self._localised.settings.pose_topic))
            self._localised.pose_refusal = ''
        except ValueError as error:
            self._localised.pose_refusal = str(error)
            self._throttled_log.log_refused(error)

    def _on_odometry(self, msg: Odometry) -> None:
        self._odometry.on_arrival(time.monotonic())
        try:
            pose = self._localised.place(pose_from_odometry(msg))
            self._localised.odometry_refusal = ''
        except ValueError as error:
            self._localised.odometry_refusal = str(error)
            self._throttled_log.log_refused(error)
            return
        if pose is not None:
            out = odometry_from_pose(pose, msg.child_frame_id)
            out.header.stamp, out.twist = msg.header.stamp, msg.twist
            out.pose.covariance = msg.pose.covariance
            self._publisher.publish(out)

    def _look(self) -> None:
        if is_tf(self._localised.settings.pose_topic):
            with suppress(ValueError):  # said when it came
                self._take_origin()
        problem, now = self._localised.problem, time.monotonic()
        if self._localised.n_leaps > self._n_leaps:
            self._n_leaps = self._localised.n_leaps
            self.get_logger().warning(  # type: ignore[no-untyped-call]
                f'the localisation found the robot {self._localised.last_leap:.2f} m from where '
                f'it was taken to be: localised_odom has leapt there ({self._n_leaps} times by '
                f'now)')
        self._suspension.look(now)
        if self._odometry.has_come and self._odometry.is_stale(now):
            problem = self._odometry.absence(now, 'odometry')
        self._throttled_log.log_missing(
            f'nothing is published: {problem}' if problem else '', 'the robot is localised')


def main(args: list[str] | None = None) -> None:
    """
    Run the node until SIGINT or SIGTERM.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong.

    """
    run_node(PROGRAM, LocalisedOdometryNode, args)


if __name__ == '__main__':
    main()
