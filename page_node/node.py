"""The node `page_node`: a page to drive and to teach from, in any browser."""

from collections.abc import Iterable
from contextlib import suppress
from functools import partial
import sys
import time
from typing import Any, Final

import rclpy
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import Empty

from control_field.robot.limits import Velocity
from msgs_bridge.node import qos
from msgs_bridge.node.command_line import check_names, names_of, Program
from msgs_bridge.node.environment import prepare
from msgs_bridge.node.peer_monitor import PeerMonitor
from msgs_bridge.node.ros_parameters import declare_parameters_from
from msgs_bridge.node.run import spin_until_signal, start_node
from msgs_bridge.node.throttled_log import ThrottledLog
from msgs_bridge.teaching.timeouts import Timeouts
from msgs_bridge.teaching.velocity_publisher import VelocityPublisher
from page_node.actions.api import endpoints as action_endpoints
from page_node.actions.wanted import Wanted
from page_node.driving.drive_watch import DriveWatch
from page_node.exchange import Endpoint
from page_node.foxglove_door import open_door
from page_node.memory.endpoints import MemoryEndpoints
from page_node.memory.worker import Worker
from page_node.refusal import RefusedError
from page_node.robot_side import RobotSide
from page_node.ros_tasks import RosTasks
from page_node.server.app import make_app
from page_node.server.guard import make_policy
from page_node.server.sockets import DriveSockets, ViewSockets
from page_node.server.view_hub import ViewHub
from page_node.server.web_server import address_of, listen, WebServer
from page_node.settings import FIXED, Settings
from page_node.story.endpoints import StoryEndpoints
from page_node.worlds.endpoints import WorldEndpoints

#: How often it is told that somebody is there, [s]: a few may be lost before a trial ends.
_HEARTBEAT_PERIOD: Final = 0.1
#: How long a thread may hold the others up, [s]: what is driven does not wait for what is shown.
_SWITCH_INTERVAL: Final = 0.0005
#: Longest wait for the standstill to arrive before this process ends.
_STANDSTILL_TIME: Final = Duration(nanoseconds=200_000_000)
#: How long ending what was begun here may take, [s].
_LEAVING_TIME: Final = 4.0

PROGRAM: Final = Program(
    'page_node', 'a page to drive and to teach from, in any browser (doc/page.md).',
    '-p host:=0.0.0.0 -p token:=...', names_of(Settings))


class PageNode(Node):
    """
    Serves the page, publishes what is driven there, shows what the other nodes publish.

    Every parameter is described in `page_node.settings`.

    Raises
    ------
    ValueError
        If a parameter is wrong, or the port taken: one line that names it.

    """

    def __init__(self, **options: Any) -> None:
        """Declare, listen, subscribe; browsers are served as soon as the node is spun."""
        super().__init__('page_node', **options)
        self.settings = declare_parameters_from(
            self, Settings, fixed=FIXED, on_change=self._on_settings)
        check_names(self)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._throttled_log = ThrottledLog(self)
        self._commands = VelocityPublisher(
            self, self.settings.topic, self._stamp if self.settings.is_stamped else None,
            self.settings.base_frame_id)
        self.hub = ViewHub()
        self._n_stops, self._is_stopping = 0, False
        self.tasks = RosTasks(self)
        self.watch = DriveWatch(self._commands.send, self.settings.speeds)
        self.peers = PeerMonitor(self)
        self.worker = Worker()
        self.robot = RobotSide(
            self, self.settings, self.watch, self.peers, self.hub,
            Timeouts(self, lambda: Future(executor=self.executor), self._steady),
            self._set_speeds)
        self._make_server(self._endpoints())
        self._make_topics()

    def _make_server(self, endpoints: Iterable[Endpoint]) -> None:
        settings = self.settings
        listener = listen(settings.host, settings.port)
        policy = make_policy(
            settings.host, listener.getsockname()[1], settings.token, settings.names)
        self.address = address_of(listener, policy.token)
        self._view = ViewSockets(self.hub)
        drive = DriveSockets(self.watch, self._on_stop)
        self._server = WebServer(listener, lambda on_start: make_app(
            policy, endpoints, drive, self._view, on_start))

    def _make_topics(self) -> None:
        self.robot.listen(self._commands, self.settings.topic, self._throttled_log.log_refused,
                          self._steady)
        self._heartbeat = self.create_publisher(Empty, 'teleop_heartbeat', qos.COMMAND)
        # From the loop that answers: one that hangs falls silent.
        self.create_timer(_HEARTBEAT_PERIOD, self._show_presence, clock=self._steady)
        self._opening = self.create_timer(0.0, self._open, clock=self._steady)
        port = self.settings.foxglove_port
        self._foxglove = open_door(self, port) if port else None

    # Doors for the rooms

    def _endpoints(self) -> list[Endpoint]:
        """Return what the rooms answer."""
        worker, bags = self.worker, self.settings.bags
        return [
            *action_endpoints(lambda wanted: self.tasks.do(partial(self.robot.perform, wanted))),
            *MemoryEndpoints(worker, bags).all(), *StoryEndpoints(worker, bags).all(),
            *WorldEndpoints(worker, self.settings.worlds_folder, bags, self.robot.changer,
                            self.tasks.do).all()]

    # What is driven

    def _stamp(self) -> Any:
        """Return the stamp of a command; in lock-step it answers the last odometry."""
        odometry = self.robot.placement.odometry if self.settings.lockstep else None
        return self.get_clock().now().to_msg() if odometry is None else odometry.header.stamp

    def _on_stop(self) -> None:
        """End whatever drives, besides who drives here: the standstill was told already."""
        with suppress(RefusedError):  # the node ends, and all that it has begun
            self.tasks.begin(self._stop)

    async def _stop(self) -> None:
        """End it, and again for who has wanted it meanwhile, however often that was."""
        self._n_stops += 1
        if self._is_stopping:
            return
        self._is_stopping, n_done = True, 0
        try:
            while n_done != self._n_stops:
                n_done = self._n_stops
                await self.robot.perform(Wanted('stop', {}))
        finally:
            self._is_stopping = False

    def _set_speeds(self, speeds: Velocity) -> str:
        """Set the speeds of a full push; return what is wrong with them."""
        result = self.set_parameters_atomically([
            Parameter(name, value=value)
            for name, value in zip(('speed', 'turn'), speeds, strict=True)])
        return '' if result.successful else str(result.reason)

    def _on_settings(self, settings: Settings) -> None:
        self.settings = settings
        self.watch.speeds = settings.speeds

    # Beginning and end

    def _open(self) -> None:
        """Let browsers in; only now is there an executor that does what they ask for."""
        self._opening.cancel()
        self.watch.start()
        self._server.start()
        # Not through the log: who reads /rosout or a log file need not get in.
        print(f'page_node: open {self.address}', flush=True)
        if self._foxglove is not None:
            print(f'page_node: open in Foxglove {self._foxglove.address}', flush=True)

    def _show_presence(self) -> None:
        if self._view.is_watched:
            self._heartbeat.publish(Empty())

    def check(self) -> None:
        """Raise what has ended a thread; nobody is to believe that somebody watches."""
        self.watch.check()
        if self._opening.is_canceled() and not self._server.is_running:
            raise RuntimeError('the server of the page has ended')

    async def leave(self) -> None:
        """End what was begun here, before nobody watches it."""
        await self.robot.leave()

    def close(self) -> None:
        """Leave the robot standing, and tell the browsers."""
        was_driving = self.watch.is_driving
        self.watch.close()
        if was_driving:
            self._commands.stand_still(_STANDSTILL_TIME)
        self._server.close()
        self.worker.close()
        if self._foxglove is not None:
            self._foxglove.close()


def main(args: list[str] | None = None) -> None:
    """
    Run the node until SIGINT or SIGTERM.

    Raises
    ------
    SystemExit
        With code 2, after one line on stderr, if an argument or a parameter is wrong.

    """
    prepare()
    sys.setswitchinterval(_SWITCH_INTERVAL)
    node = None
    try:
        node = start_node(PROGRAM, PageNode, args)
        spin_until_signal(node, node.check)
        _leave(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if node is not None and rclpy.ok():
            node.close()
        rclpy.try_shutdown()


def _leave(node: PageNode) -> None:
    """Stand first; then end what was begun here, within a time."""
    node.watch.halt()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    task = executor.create_task(node.leave)
    deadline = time.monotonic() + _LEAVING_TIME
    while not task.done() and time.monotonic() < deadline and rclpy.ok():
        executor.spin_once(_HEARTBEAT_PERIOD)
    executor.shutdown()


if __name__ == '__main__':
    main()
