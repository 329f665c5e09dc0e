"""What a session has heard from the topics, and when."""

from dataclasses import dataclass
import math
from typing import TypeGuard

from control_field.robot.suspension import Suspension
from msgs_bridge.messages.trial_status import State, TrialStatus


def is_running(status: TrialStatus | None) -> TypeGuard[TrialStatus]:
    """Return True while a trial runs or is paused."""
    return status is not None and status.state in (State.RUNNING, State.PAUSED)


@dataclass(frozen=True)
class Peers:
    """Who is there: the controller, and a robot that publishes odometry."""

    controller: bool = False
    robot: bool = False

    def lost(self, later: 'Peers') -> str:
        """Say who is no longer there later; empty if nobody has gone."""
        return ' and '.join(
            name for name, was, there in (('the controller', self.controller, later.controller),
                                          ('the robot', self.robot, later.robot))
            if was and not there)


class Inputs:
    """The newest of what the topics have said."""

    def __init__(self) -> None:
        """Start with nothing heard."""
        self.peers = Peers()
        self.status: TrialStatus | None = None
        self.odometry_stamp = 0.0  #: [s]
        self.local_grid_stamp: float | None = None  #: [s]
        #: When odometry arrived last, and when the last sign of life did, [s].
        self.last_odometry = self.last_sign_of_life = -math.inf
        self.suspension = Suspension()
        self.slept = 0.0  #: longest sleep of this process since the controller was heard, [s]

    def on_suspended(self, seconds: float, now: float) -> None:
        """Count the time during which this process was suspended as nobody's silence."""
        self.slept = max(self.slept, seconds)
        self.last_odometry = min(self.last_odometry + seconds, now)
        self.last_sign_of_life = min(self.last_sign_of_life + seconds, now)

    def awaits_local_grid(self, stamp: float) -> bool:
        """Return True if the local grid of a stamp may yet come: an older one has."""
        return self.local_grid_stamp is not None and self.local_grid_stamp < stamp

    def silence(self, now: float, since: float, timeout: float) -> str:
        """
        Say what has not come for too long; empty if nothing has.

        Parameters
        ----------
        now, since : float, [s]
            The time, and when the wait began.
        timeout : float, [s]

        """
        silent = now - max(self.last_sign_of_life, since)
        if silent <= timeout:
            return ''
        is_lost = now - self.last_odometry > timeout
        what = 'odometry' if is_lost else 'command of the controller'
        return f'no {what} for {silent:.1f} s'
