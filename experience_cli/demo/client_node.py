"""The demo's own node: drives the demonstration, changes the world, watches the trials."""

from collections.abc import Callable
import math
import sys
import time
from types import TracebackType
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import SetParameters
import rclpy
from rclpy.exceptions import InvalidNamespaceException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.validate_namespace import validate_namespace
from std_msgs.msg import Empty
from std_srvs.srv import SetBool, Trigger

from experience_cli.demo.path_follower import Driver
from experience_cli.demo.peers import absent_nodes, mistyped, start_hint, what_is_missing
from experience_cli.errors import UserError
from msgs_bridge.messages.poses import Pose, pose_from_odometry
from msgs_bridge.messages.trial_status import trial_from_status, TrialStatus
from msgs_bridge.messages.velocities import fill_twist
from msgs_bridge.node import qos
from msgs_bridge.node.safe_log import guard_logs

#: How long peers may take to be found and to answer, [s]: cold starts compile, on a machine that
#: may be busy with something else. Who has ended is noticed at once.
PATIENCE: Final = 180.0
#: Time after which a request without an answer is made again, [s]; and the same for one that
#: changes something, if nothing has changed, or whose answer is no more waited for if it has.
_PATIENT: Final = 2.0
_UNHEARD: Final = 10.0
#: Time without odometry after which the driver's last command is sent again, [s].
_STUCK: Final = 2.0
#: How long the robot may not come on, [s].
_STANDSTILL: Final = 60.0
#: What the learner is doing while an answer may take long.
_AT_WORK: Final = ('settling', 'learning')
#: Ticks that the driver stands still at the end, so that the robot has surely stopped.
_STANDING: Final = 3


class DemoNode:
    """
    A node in a context of its own; a context manager.

    Parameters
    ----------
    domain : int or None
        ROS domain; None: as the environment says.
    check : callable
        Called while waiting; raises when there is nothing left to wait for.
    namespace : str
        Of the nodes it deals with.

    Raises
    ------
    UserError
        If the namespace is none.

    """

    def __init__(
        self, domain: int | None, check: Callable[[], None], namespace: str = '',
    ) -> None:
        where = '/' + namespace.lstrip('/')
        try:
            validate_namespace(where)
        except InvalidNamespaceException:
            raise UserError(f'{namespace!r} is no namespace, must be like robot1') from None
        self._check = check
        guard_logs()
        self._context = rclpy.Context()
        rclpy.init(args=[], context=self._context, domain_id=domain,
                   signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node('experience_demo', namespace=where, context=self._context,
                          use_global_arguments=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self.status: TrialStatus | None = None
        self.learner: dict[str, str] = {}
        self._driver: Driver | None = None
        self._n_standing, self._answered = 0, -math.inf
        self._refused: set[str] = set()
        self._command = TwistStamped()
        self._command.header.frame_id = 'base_footprint'
        self._commands = self._node.create_publisher(TwistStamped, 'cmd_vel', qos.LOCKSTEP_PUB)
        self._node.create_subscription(
            DiagnosticStatus, 'trial', self._on_trial, qos.RECORDING_LATCHED)
        self._node.create_subscription(
            DiagnosticArray, '/diagnostics', self._on_diagnostics, 50)
        self._node.create_subscription(Odometry, 'odom', self._on_odometry, qos.ODOMETRY_PUB)
        #: The newest that has arrived and is valid.
        self.odometry: Odometry | None = None

    def __enter__(self) -> 'DemoNode':
        """Return the node."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Leave ROS."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def wait_until(self, is_done: Callable[[], Any], what: str, patience: float = PATIENCE) -> Any:
        """
        Work until something is so, and return what was found to be true.

        Raises
        ------
        UserError
            If it takes too long; it names ``what``.

        """
        deadline = time.monotonic() + patience
        while not (found := is_done()):
            self._check()
            if time.monotonic() > deadline:
                raise UserError(f'{what} did not come within {patience:g} s')
            self._executor.spin_once(0.1)
        return found

    def call(self, kind: Any, name: str, request: Any, repeats: bool = False) -> Any:
        """
        Call a service and return its response.

        A request on the heels of discovery may be lost: one that ``repeats`` is made again.
        """
        client = self._node.create_client(kind, name)
        self.wait_until(client.service_is_ready, f'the service {name}')
        futures: list[Any] = []
        asked = -math.inf

        def answered() -> Any:
            nonlocal asked
            if not futures or (repeats and time.monotonic() - asked > _PATIENT):
                futures.append(client.call_async(request))
                asked = time.monotonic()
            return next((future for future in futures if future.done()), None)

        future = self.wait_until(answered, f'the answer of {name}')
        self._node.destroy_client(client)
        return future.result()

    def ask(self, name: str, data: bool | None = None) -> str:
        """
        Call a service of the learner, with data a SetBool; return what it says.

        A request or its answer may be lost on the heels of discovery: what counts is what the
        learner does. While it goes on as before it is asked again; once it does something else
        that was the answer.

        Raises
        ------
        UserError
            If it does not do what was asked.

        """
        kind = Trigger if data is None else SetBool
        request = kind.Request() if data is None else kind.Request(data=data)
        client = self._node.create_client(kind, name)
        self.wait_until(client.service_is_ready, f'the service {name}')
        before, asked, futures = self._standing(), -math.inf, list[Any]()

        def answer() -> tuple[bool, str] | None:
            nonlocal asked
            done = [future.result() for future in futures if future.done()]
            best = next((each for each in done if each.success), None)
            is_late = time.monotonic() - asked > _UNHEARD
            if best is not None or (done and (is_late or len(done) == len(futures))):
                best = best or done[0]
                return best.success, str(best.message)
            has_changed = self._standing() != before
            if has_changed and is_late and self.learner.get('phase') not in _AT_WORK:
                return True, ''
            if is_late and not has_changed:
                futures.append(client.call_async(request))
                asked = time.monotonic()
            return None

        success, message = self.wait_until(answer, f'the answer of {name}')
        self._node.destroy_client(client)
        if not success:
            raise UserError(f'{name}: {message}')
        return str(message)

    def _standing(self) -> tuple[str | None, ...]:
        """Return what changes once the learner has received a request."""
        return tuple(self.learner.get(name) for name in ('phase', 'trials_left', 'revision'))

    def set_parameter(self, node: str, name: str, value: object) -> None:
        """
        Set a parameter of another node.

        Raises
        ------
        UserError
            If it is refused.

        """
        request = SetParameters.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()])
        result = self.call(
            SetParameters, f'{node}/set_parameters', request, repeats=True).results[0]
        if not result.successful:
            raise UserError(f'{node}: {result.reason}')

    def wait_for_peers(
        self, tell: Callable[[str], None] = lambda what: None, patience: float = math.inf,
    ) -> None:
        """
        Wait until simulator, controller and learner have found each other.

        Parameters
        ----------
        tell : callable
            Called with what is waited for, again and again.
        patience : float, [s]
            How long a node may not be there at all.

        Raises
        ------
        UserError
            If a node does not come, or reads `cmd_vel` as another type.

        """
        began = time.monotonic()

        def found() -> bool:
            absent = self._absent()
            if absent and time.monotonic() - began > patience:
                raise UserError(self._not_there(absent))
            wrong = mistyped(self._node.get_subscriptions_info_by_topic(
                self._node.resolve_topic_name('cmd_vel')))
            if wrong:
                raise UserError(wrong)
            tell(what_is_missing(absent, self.odometry is not None, self.learner))
            return not absent and self._is_complete()

        self.wait_until(found, 'simulator, controller and learner', PATIENCE + 1.0)

    def wait_for_viewers(self) -> None:
        """Wait, for as long as it takes, until somebody looks at the page."""
        heard: list[Empty] = []
        subscription = self._node.create_subscription(
            Empty, 'teleop_heartbeat', heard.append, qos.COMMAND)
        self.wait_until(lambda: heard, 'somebody who looks at the page', math.inf)
        self._node.destroy_subscription(subscription)

    def _is_complete(self) -> bool:
        heard = self.learner.get('heard', '').split()
        return (self.odometry is not None and self.learner.get('phase') == 'idle'
                and {'odom', 'neighbourhood', 'trial'} <= set(heard)
                and self._commands.get_subscription_count() >= 3
                and self._node.count_subscribers('initialpose') >= 2)

    def _absent(self) -> list[str]:
        namespace = self._node.get_namespace()
        return absent_nodes(name for name, where in self._node.get_node_names_and_namespaces()
                            if where == namespace)

    def _not_there(self, absent: list[str]) -> str:
        namespace = self._node.get_namespace()
        where = f'in ROS domain {self._context.get_domain_id()}, namespace {namespace}'
        return (f'there is no {" and no ".join(absent)} {where}: start what is missing with '
                f'{start_hint(absent, namespace)}; without --attach the demo starts its own nodes')

    def drive(self, driver: Driver, tell: Callable[[float], None]) -> None:
        """
        Drive a line in lock-step: every odometry is answered by a command with its stamp.

        Parameters
        ----------
        driver : Driver
        tell : callable
            Gets the share of the way that is done.

        """
        self._driver, self._n_standing = driver, 0
        moved = [-1.0, time.monotonic()]
        self._answered = -math.inf

        def is_done() -> bool:
            if self.odometry is not None and time.monotonic() - self._answered > _STUCK:
                # The first one, and one that got lost: the simulator waits for it.
                self._answer(self.odometry, pose_from_odometry(self.odometry))
            tell(min(driver.travelled / driver.length, 1.0))
            if driver.travelled > moved[0]:
                moved[:] = driver.travelled, time.monotonic()
            return self._driver is None or time.monotonic() - moved[1] > _STANDSTILL

        self.wait_until(is_done, 'the end of the demonstration', math.inf)
        if self._driver is not None:
            self._driver = None
            raise UserError(f'the robot does not move: it came {driver.travelled:.1f} m far of '
                            f'{driver.length:.1f} m')

    def _on_odometry(self, msg: Odometry) -> None:
        pose = self._read(pose_from_odometry, msg, 'odom')
        if pose is None:
            return
        self.odometry = msg
        self._answer(msg, pose)

    def _read(self, reader: Callable[[Any], Any], msg: Any, topic: str) -> Any:
        """Return what a message says; None if it is invalid, which is printed once a topic."""
        try:
            return reader(msg)
        except ValueError as error:
            if topic not in self._refused:
                self._refused.add(topic)
                print(f'experience demo: a message on {topic} is passed over: {error}',
                      file=sys.stderr, flush=True)
            return None

    def _answer(self, msg: Odometry, pose: Pose) -> None:
        """Answer odometry with the driver's next command."""
        if self._driver is None:
            return
        command = self._driver.command(pose.x, pose.y, pose.yaw)
        if command is None:
            self._n_standing += 1
            if self._n_standing > _STANDING:
                self._driver = None
                return
        self._command.header.stamp = msg.header.stamp
        fill_twist(self._command, *(command or (0.0, 0.0)))
        self._commands.publish(self._command)
        self._answered = time.monotonic()

    def _on_trial(self, msg: DiagnosticStatus) -> None:
        self.status = self._read(trial_from_status, msg, 'trial') or self.status

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        ours = f'{self._node.get_namespace().strip("/")}/learner_node: learner'.lstrip('/')
        for status in msg.status:
            if status.name == ours:
                self.learner = {pair.key: pair.value for pair in status.values}
