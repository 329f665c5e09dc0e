"""The other nodes around a node: what they are started with, and what of it conflicts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import math
import os
import secrets
import socket
from threading import Lock
import time
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock
from rclpy.clock_type import ClockType

from control_field.grid import Grid
from msgs_bridge.messages.serialized import message_from_cdr
from msgs_bridge.node import qos
from msgs_bridge.node.duplicate_publishers import DuplicateMonitor
from msgs_bridge.node.graph import found_elsewhere, type_conflict
from msgs_bridge.node.node_info import (
    cells_of, Conflict, conflicts, node_info_from_status, NodeInfo, Operation,
    values_from_node_info)
from msgs_bridge.node.reader_threads import ReaderThreads
from msgs_bridge.node.throttled_log import OncePerTemplate

#: Time between two looks at the graph, and between two evaluations, [s].
_PERIOD: Final = 1.0
_PAUSE: Final = 0.1
#: Time after which a peer that says nothing is gone, [s]; peers publish every second.
_PEER_TIMEOUT: Final = 4.0
#: What a robot publishes, as which type, and which operations need it.
_SENSED: Final = (
    ('odom', 'nav_msgs/msg/Odometry', frozenset((Operation.TEACH, Operation.DRIVE))),
    ('neighbourhood', 'nav_msgs/msg/OccupancyGrid', frozenset((Operation.DRIVE,))))
#: Phase of a learner that records a demonstration, and why nothing drives meanwhile.
_RECORDING: Final = 'demonstration'
_WHILE_RECORDING: Final = (
    '{} records a demonstration, and what a trial drives is not what a person shows; press n in '
    'teleop_node to keep it, a to throw it away')
#: Number of looks without simulation time until that is logged.
_N_TIMELESS: Final = 4
_NO_TIME: Final = (
    'use_sim_time is true, and nothing has arrived on /clock: time stands still here. Start what '
    'publishes /clock (sim_node does), or leave use_sim_time out')
#: Number of looks after which a publisher of this node's topics would have been discovered.
_N_DISCOVERY: Final = 6
#: Greatest number of peers, and what their diagnostics contain.
_MAX_PEERS: Final = 64
_MARK: Final = b'instance'
#: Greatest message that is decoded, [bytes]; those of our nodes have some kB.
_MAX_BYTES: Final = 32_768


@dataclass
class _Peer:
    info: NodeInfo
    first: float
    last: float


class PeerTable:
    """
    The peers of one namespace, and what of them conflicts. ROS-free: time is an argument.

    Parameters
    ----------
    name : str
        Full name of this node.
    role : str
        Its role in `msgs_bridge.node.node_info.ROLES`; empty for one that describes nothing.

    """

    def __init__(self, name: str, role: str = '') -> None:
        """Start alone."""
        machine = socket.gethostname()[:60] or 'machine'
        self.own = NodeInfo(name, role, f'{machine}-{os.getpid()}-{secrets.token_hex(4)}')
        self._peers: dict[str, _Peer] = {}

    def update(self, info: NodeInfo, now: float) -> None:
        """Add or refresh a peer; ignore this node itself and other namespaces."""
        if info.namespace != self.own.namespace or info.instance == self.own.instance:
            return
        self._peers = {key: peer for key, peer in self._peers.items()
                       if now - peer.last < _PEER_TIMEOUT}
        known = self._peers.get(info.instance)
        if known is None and len(self._peers) >= _MAX_PEERS:
            return
        self._peers[info.instance] = _Peer(info, now if known is None else known.first, now)

    def conflicts(self, now: float) -> list[Conflict]:
        """Return what conflicts among the peers that are alive and this node."""
        return conflicts([*self._alive(now), *([self.own] if self.own.role else [])])

    def recorder(self, now: float) -> str:
        """Return the name of a peer that records a demonstration; empty if none does."""
        return next((info.label for info in self._alive(now)
                     if info.role == 'learner' and info.phase == _RECORDING), '')

    def cells(self, roles: Sequence[str], now: float) -> Grid | None:
        """Return a cell of those that a peer has, of the first of some roles that says any."""
        said = [(info.role, cells_of(info)) for info in self._alive(now)]
        return next((cells for role in roles for whose, cells in said
                     if whose == role and cells is not None), None)

    def _alive(self, now: float) -> list[NodeInfo]:
        peers = [peer for peer in self._peers.values() if now - peer.last < _PEER_TIMEOUT]
        return [peer.info for peer in peers if not self._is_replaced(peer)]

    def _is_replaced(self, peer: _Peer) -> bool:
        """Return whether another of its name has begun since it last published: a restart."""
        return any(other.info.name == peer.info.name and other.first > peer.last
                   for other in self._peers.values())


class PeerMonitor:
    """
    Watches the peers of a node, and logs each conflict once.

    Parameters
    ----------
    node : rclpy.node.Node
    role : str, optional
        Of the node, see `PeerTable`.
    say : callable, optional
        Gets each line about a conflict; a warning in the node's log by default.
    threads : ReaderThreads, optional
        Read `/diagnostics` and look at the graph in these, if they are enabled.

    Attributes
    ----------
    problems : list of Conflict
        What conflicts now.

    """

    def __init__(
        self, node: Any, role: str = '', say: Callable[[str], None] | None = None,
        threads: ReaderThreads | None = None,
    ) -> None:
        """Subscribe to `/diagnostics`, and look at the graph periodically."""
        self._node = node
        self._say = say or (lambda text: node.get_logger().warning(text))
        self._peers = PeerTable(node.get_fully_qualified_name(), role)
        self._duplicates, self._logged = DuplicateMonitor(node), OncePerTemplate(template=str)
        self.problems: list[Conflict] = []
        self._mistyped: list[Conflict] = []
        self._evaluated_at, self._n_timeless = -math.inf, 0
        self._n_missing = 0
        self._lock = Lock()  # several threads may call
        if threads is None or not threads.is_enabled:
            node.create_subscription(
                DiagnosticArray, '/diagnostics', self._on_diagnostics, qos.DIAGNOSTICS, raw=True)
            node.create_timer(_PERIOD, self.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        else:
            threads.subscribe(DiagnosticArray, '/diagnostics', self._on_diagnostics,
                              (qos.DIAGNOSTICS,), _MAX_BYTES, is_locked=False)
            threads.repeat(self.look, _PERIOD)

    def describe(
        self, workspace: Mapping[str, Any] | None = None, method: Mapping[str, Any] | None = None,
    ) -> None:
        """Set the parameters that this node tells its peers."""
        self._peers.own = replace(self._peers.own, workspace=workspace, method=method)

    def add_to(self, status: Any) -> None:
        """Add the description of this node, and its conflicts, to a DiagnosticStatus."""
        values = {**values_from_node_info(self._peers.own),
                  'does_not_fit': '; '.join(problem.text for problem in self.problems)}
        status.values = [*status.values, *(
            KeyValue(key=key, value=value) for key, value in values.items())]
        if self.problems and status.level == DiagnosticStatus.OK:
            status.level, status.message = DiagnosticStatus.WARN, self.problems[0].text

    def why_not(self, operation: Operation) -> str:
        """Return why an operation must not be done now; empty if it may."""
        problem = next(
            (problem.text for problem in self.problems if operation in problem.prevents), '')
        if problem or operation is not Operation.DRIVE:
            return problem
        recorder = self.recorder()
        return _WHILE_RECORDING.format(recorder) if recorder else ''

    def recorder(self) -> str:
        """Return the name of a learner that records a demonstration; empty if none does."""
        with self._lock:
            return self._peers.recorder(time.monotonic())

    def cells(self, *roles: str) -> Grid | None:
        """Return a cell of those that a peer has, of the first of some roles that says any."""
        with self._lock:
            return self._peers.cells(roles, time.monotonic())

    def _on_diagnostics(self, cdr: bytes | int) -> None:
        if isinstance(cdr, int) or len(cdr) > _MAX_BYTES or _MARK not in cdr:
            return  # of other nodes than ours
        try:
            array = message_from_cdr(cdr, DiagnosticArray)
        except (ValueError, RuntimeError):
            return
        infos = [*filter(None, map(node_info_from_status, array.status))]
        with self._lock:
            now = time.monotonic()
            for info in infos:
                self._peers.update(info, now)
            if now - self._evaluated_at >= _PAUSE:  # a flood must not keep the node busy
                self._evaluate(now)

    def look(self) -> None:
        """Look at the graph for duplicate and missing publishers, and evaluate all again."""
        with self._lock:
            self._look(time.monotonic())

    def _look(self, now: float) -> None:
        for text in self._duplicates.look(now):
            self._tell(text)
        if self._n_timeless < _N_TIMELESS:
            self._look_at_clock()
        self._mistyped = [Conflict(text, prevents) for topic, kind, prevents in _SENSED if (
            text := self._type_conflict(self._node.resolve_topic_name(topic), kind))]
        self._look_elsewhere()
        self._evaluate(now)

    def _look_elsewhere(self) -> None:
        """Log, once there was time for discovery, where odometry is that is missing here."""
        topic, kind, _ = _SENSED[0]
        name = self._node.resolve_topic_name(topic)
        self._n_missing = 0 if self._node.count_publishers(name) else self._n_missing + 1
        if self._n_missing == _N_DISCOVERY and (text := found_elsewhere(
                name, kind, self._published())):
            self._tell(text)

    def _published(self) -> list[tuple[str, list[str]]]:
        return [(name, kinds) for name, kinds in self._node.get_topic_names_and_types()
                if self._node.count_publishers(name)]

    def _look_at_clock(self) -> None:
        """Log that simulation time has never come; ROS waits for it without a word."""
        self._n_timeless += 1
        if self._node.get_parameter('use_sim_time').value is not True or (
                self._node.get_clock().now().nanoseconds):
            self._n_timeless = 0
        elif self._n_timeless == _N_TIMELESS:
            self._tell(_NO_TIME)

    def _type_conflict(self, topic: str, kind: str) -> str:
        return type_conflict(topic, self._node.get_publishers_info_by_topic(topic), kind)

    def _evaluate(self, now: float) -> None:
        self._evaluated_at = now
        self.problems = [*self._peers.conflicts(now), *self._mistyped]
        for problem in self.problems:
            self._tell(problem.text, problem.log_key)

    def _tell(self, text: str, log_key: str = '') -> None:
        if self._logged.add(log_key or text):
            self._say(text)
