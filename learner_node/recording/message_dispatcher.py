"""Messages on their way from the topics to the session."""

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import PointCloud2

from control_field.grid import Grid
from learner_node.recording.odometry_check import OdometryCheck
from learner_node.recording.recorder import stamp_of
from learner_node.session.outputs import Outputs
from learner_node.session.session import Session
from msgs_bridge.messages.serialized import message_from_cdr
from msgs_bridge.messages.tables import decisions_from_cloud
from msgs_bridge.messages.trial_status import trial_from_status
from msgs_bridge.node.throttled_log import ThrottledLog


class MessageDispatcher:
    """
    Decodes what arrives and hands it to the session; a message that is no such one is refused.

    Parameters
    ----------
    session : Session
    grid : Grid or None
        The workspace, if it is set.
    carry_out : callable
        Does what the session wants done.
    check : OdometryCheck
    throttled_log : ThrottledLog
        Logs what is refused.

    """

    def __init__(
        self, session: Session, grid: Grid | None, carry_out: Callable[[Outputs], None],
        check: OdometryCheck, throttled_log: ThrottledLog,
    ) -> None:
        self._session, self._grid = session, grid
        self._carry_out = carry_out
        self._check = check
        self._throttled_log = throttled_log
        #: The newest local grid, serialised; empty before the first.
        self.local_grid = b''
        #: Topics that something has arrived on.
        self.topics_heard: set[str] = set()
        #: Stamp of the newest odometry, [ns].
        self.odometry_time = 0
        self._handlers: dict[str, Callable[[bytes], None]] = {
            'odom': self._on_odometry, 'experience': self._on_experience,
            'trial': self._on_trial, 'neighbourhood': self._on_local_grid,
            'cmd_vel': lambda _: self._session.on_command(time.monotonic())}

    @property
    def place(self) -> tuple[float, float] | None:
        """Return where the robot was last, ``(x, y)`` [m]; None before it was heard of."""
        return self._check.place

    @property
    def n_refused(self) -> int:
        """Return the number of messages that were refused."""
        return self._throttled_log.n_refused

    def dispatch(self, name: str, cdr: bytes) -> None:
        """Hand a message of a topic, such as ``odom``, to the session."""
        self.topics_heard.add(name)
        handle = self._handlers.get(name)
        if handle is not None:
            handle(cdr)

    def _on_odometry(self, cdr: bytes) -> None:
        self.odometry_time = stamp_of(cdr)
        now = time.monotonic()
        self._carry_out(self._session.on_odometry(self.odometry_time * 1e-9, now))
        wants = self._session.wants_pose(now)
        if not wants and not self._check.is_due(now):
            return
        try:
            pose = self._check.read(cdr, now)
        except (ValueError, RuntimeError) as error:
            self._session.demonstration.odometry.on_unsound(self._check.problem, now)
            if wants:
                self._throttled_log.log_refused(error, 'odom')
            return
        if self._check.problem:
            self._session.demonstration.odometry.on_unsound(self._check.problem, now)
        else:
            self._session.demonstration.odometry.on_sound()
        if wants:
            self._carry_out(self._session.on_pose(pose.x, pose.y, pose.yaw, now))

    def _on_local_grid(self, cdr: bytes) -> None:
        self.local_grid = cdr
        self._carry_out(self._session.on_local_grid(stamp_of(cdr) * 1e-9, time.monotonic()))

    def _on_experience(self, cdr: bytes) -> None:
        rows = self._read(partial(decisions_from_cloud, grid=self._grid), PointCloud2, cdr)
        if rows is not None and len(rows):
            self._carry_out(self._session.trials.on_decisions(
                int(rows['trial'][0]), len(rows), time.monotonic()))

    def _on_trial(self, cdr: bytes) -> None:
        status = self._read(trial_from_status, DiagnosticStatus, cdr)
        if status is not None:
            self._carry_out(self._session.on_status(status, time.monotonic()))

    def _read(self, reader: Callable[[Any], Any], kind: Any, cdr: bytes) -> Any:
        """Return what a message says; None, and a warning, if it is refused."""
        try:
            return reader(message_from_cdr(cdr, kind))
        except (ValueError, RuntimeError) as error:
            self._throttled_log.log_refused(error, kind)
            return None
