"""Whom a node meets: the other nodes of its suite, and those of others that got among them."""

from collections.abc import Callable, Mapping
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

from msgs_bridge.messages.serialized import message_from_cdr
from msgs_bridge.node import qos
from msgs_bridge.node.doubles import DuplicateMonitor
from msgs_bridge.node.graph import elsewhere, in_vain
from msgs_bridge.node.reader_threads import Ears
from msgs_bridge.node.statements import (
    Deed, Misfit, misfits, Statement, statement_from_status, values_from_statement)
from msgs_bridge.node.throttled_log import OncePerTemplate

#: How often a node looks around, [s], and how long a statement holds; they come every second.
_PERIOD: Final = 1.0
_PAUSE: Final = 0.1
_HOLDS: Final = 4.0
#: What a robot says, as which type, and what does not go without it.
_SENSED: Final = (
    ('odom', 'nav_msgs/msg/Odometry', frozenset((Deed.TEACH, Deed.DRIVE))),
    ('neighbourhood', 'nav_msgs/msg/OccupancyGrid', frozenset((Deed.DRIVE,))))
#: What a learner says of itself that records a demonstration; and why nothing drives meanwhile.
_RECORDS: Final = 'demonstration'
_RECORDED: Final = ('{} records a demonstration, and what a trial drives is not what a person '
                    'shows; press n in teleop_node to keep it, a to throw it away')
#: After so many looks without a time somebody is told that none comes.
_TIMELESS: Final = 4
_NO_TIME: Final = (
    'use_sim_time is true, and nothing has arrived on /clock: time stands still here. Start what '
    'publishes /clock (sim_node does), or leave use_sim_time out')
#: After so many looks what belongs to this node would have appeared.
_APPEARED: Final = 6
#: So many processes are heard at most; and what every statement holds.
_MOST: Final = 64
_MARK: Final = b'instance'
#: A message of ours has some kB; a greater one is not worth to be decoded, [bytes].
_GREATEST: Final = 32_768


@dataclass
class _Heard:
    statement: Statement
    first: float
    last: float


class Company:
    """
    What the statements of one namespace come to. ROS-free: time is an argument.

    Parameters
    ----------
    name : str
        Full name of this node.
    role : str
        Its role in `msgs_bridge.node.statements.ROLES`; empty for one that says nothing of itself.

    """

    def __init__(self, name: str, role: str = '') -> None:
        """Start alone."""
        machine = socket.gethostname()[:60] or 'machine'
        self.own = Statement(name, role, f'{machine}-{os.getpid()}-{secrets.token_hex(4)}')
        self._heard: dict[str, _Heard] = {}

    def saw(self, statement: Statement, now: float) -> None:
        """Take in a statement; those of other namespaces, and the own one, are passed over."""
        if statement.namespace != self.own.namespace or statement.instance == self.own.instance:
            return
        before = self._heard.get(statement.instance)
        if before is None and len(self._heard) >= _MOST:
            return
        self._heard[statement.instance] = _Heard(
            statement, now if before is None else before.first, now)

    def misfits(self, now: float) -> list[Misfit]:
        """Return what does not fit."""
        self._heard = {key: heard for key, heard in self._heard.items()
                       if now - heard.last < _HOLDS}
        alive = [heard.statement for heard in self._heard.values()
                 if not self._is_survived(heard)]
        return misfits([*alive, *([self.own] if self.own.role else [])])

    def recorder(self, now: float) -> str:
        """Return the name of another node that records a demonstration; empty if none does."""
        return next((heard.statement.called for heard in self._heard.values()
                     if now - heard.last < _HOLDS and heard.statement.role == 'learner'
                     and heard.statement.phase == _RECORDS and not self._is_survived(heard)), '')

    def _is_survived(self, heard: _Heard) -> bool:
        """Tell whether another of its name has begun since it last spoke: it was started anew."""
        return any(other.statement.name == heard.statement.name and other.first > heard.last
                   for other in self._heard.values())


class PeerMonitor:
    """
    Looks around for a node, and says once what does not fit.

    Parameters
    ----------
    node : rclpy.node.Node
    role : str, optional
        Of the node, see `Company`.
    say : callable, optional
        Is told what does not fit; a warning in the node's log by default.
    ears : Ears, optional
        Hear `/diagnostics`, and look around, in their threads; the node does otherwise.

    Attributes
    ----------
    problems : list of Misfit
        What does not fit now.

    """

    def __init__(
        self, node: Any, role: str = '', say: Callable[[str], None] | None = None,
        ears: Ears | None = None,
    ) -> None:
        """Listen to `/diagnostics` and look at the graph now and then."""
        self._node = node
        self._say = say or (lambda text: node.get_logger().warning(text))
        self._company = Company(node.get_fully_qualified_name(), role)
        self._doubles, self._logged = DuplicateMonitor(node), OncePerTemplate(template=str)
        self.problems: list[Misfit] = []
        self._mistyped: list[Misfit] = []
        self._judged_at, self._n_timeless = -math.inf, 0
        self._n_missing = 0
        self._lock = Lock()  # ears have several threads
        if ears is None:
            node.create_subscription(
                DiagnosticArray, '/diagnostics', self._on_diagnostics, qos.STATEMENTS, raw=True)
            node.create_timer(_PERIOD, self.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        else:
            ears.hear(DiagnosticArray, '/diagnostics', self._on_diagnostics, (qos.STATEMENTS,),
                      _GREATEST, is_locked=False)
            ears.repeat(self.look, _PERIOD)

    def state(
        self, workspace: Mapping[str, Any] | None = None, method: Mapping[str, Any] | None = None,
    ) -> None:
        """Set what this node says of itself."""
        self._company.own = replace(self._company.own, workspace=workspace, method=method)

    def add_to(self, status: Any) -> None:
        """Add to a DiagnosticStatus what this node says of itself, and what does not fit."""
        values = {**values_from_statement(self._company.own),
                  'does_not_fit': '; '.join(problem.text for problem in self.problems)}
        status.values = [*status.values, *(
            KeyValue(key=key, value=value) for key, value in values.items())]
        if self.problems and status.level == DiagnosticStatus.OK:
            status.level, status.message = DiagnosticStatus.WARN, self.problems[0].text

    def why_not(self, deed: Deed) -> str:
        """Say why something must not be done now; empty if it may be."""
        problem = next((problem.text for problem in self.problems if deed in problem.stops), '')
        with self._lock:
            recorder = self._company.recorder(time.monotonic()) if deed is Deed.DRIVE else ''
        return problem or (_RECORDED.format(recorder) if recorder else '')

    def _on_diagnostics(self, cdr: bytes | int) -> None:
        if isinstance(cdr, int) or len(cdr) > _GREATEST or _MARK not in cdr:
            return  # of other nodes than ours
        try:
            array = message_from_cdr(cdr, DiagnosticArray)
        except (ValueError, RuntimeError):
            return
        statements = [*filter(None, map(statement_from_status, array.status))]
        with self._lock:
            now = time.monotonic()
            for statement in statements:
                self._company.saw(statement, now)
            if now - self._judged_at >= _PAUSE:  # a flood of them must not keep the node busy
                self._judge(now)

    def look(self) -> None:
        """Look who publishes what only one may publish, and what does not hold any more."""
        with self._lock:
            self._look(time.monotonic())

    def _look(self, now: float) -> None:
        for text in self._doubles.look(now):
            self._tell(text)
        if self._n_timeless < _TIMELESS:
            self._look_at_clock()
        self._mistyped = [Misfit(text, stops) for topic, kind, stops in _SENSED if (
            text := self._in_vain(self._node.resolve_topic_name(topic), kind))]
        self._look_elsewhere()
        self._judge(now)

    def _look_elsewhere(self) -> None:
        """Say, once it has had the time to appear, where odometry is that is not here."""
        topic, kind, _ = _SENSED[0]
        name = self._node.resolve_topic_name(topic)
        self._n_missing = 0 if self._node.count_publishers(name) else self._n_missing + 1
        if self._n_missing == _APPEARED and (text := elsewhere(name, kind, self._published())):
            self._tell(text)

    def _published(self) -> list[tuple[str, list[str]]]:
        return [(name, kinds) for name, kinds in self._node.get_topic_names_and_types()
                if self._node.count_publishers(name)]

    def _look_at_clock(self) -> None:
        """Say that the time of a simulation has never come; ROS waits for it without a word."""
        self._n_timeless += 1
        if self._node.get_parameter('use_sim_time').value is not True or (
                self._node.get_clock().now().nanoseconds):
            self._n_timeless = 0
        elif self._n_timeless == _TIMELESS:
            self._tell(_NO_TIME)

    def _in_vain(self, topic: str, kind: str) -> str:
        return in_vain(topic, self._node.get_publishers_info_by_topic(topic), kind)

    def _judge(self, now: float) -> None:
        self._judged_at = now
        self.problems = [*self._company.misfits(now), *self._mistyped]
        for problem in self.problems:
            self._tell(problem.text, problem.subject)

    def _tell(self, text: str, subject: str = '') -> None:
        if self._logged.add(subject or text):
            self._say(text)
