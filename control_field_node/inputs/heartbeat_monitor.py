"""Whether a person watches over the robot: a heartbeat that must not fall silent. ROS-free."""

import math
from typing import Final

from control_field_node.settings import Settings

#: Most that the time between two checks counts, [s]: while this process is held up, heartbeats
#: that have arrived wait to be read, and that is no silence.
_MAX_STEP: Final = 0.3


class HeartbeatMonitor:
    """
    The heartbeat of teleop_node.

    Parameters
    ----------
    settings : Settings
        Whether one is needed, and how long it may be silent.

    """

    def __init__(self, settings: Settings) -> None:
        """Start with none."""
        self.settings = settings
        self._silence = math.inf
        self._updated_at = -math.inf

    def on_heartbeat(self, _: object = None) -> None:
        """Take in a heartbeat; its message says nothing."""
        self._silence = 0.0

    def update(self, now: float) -> None:
        """Let time pass; call it about every 0.1 s."""
        self._silence += min(max(now - self._updated_at, 0.0), _MAX_STEP)
        self._updated_at = now

    @property
    def is_missing(self) -> bool:
        """Return whether a heartbeat is needed and has been silent for too long."""
        return self.settings.heartbeat and self._silence > self.settings.heartbeat_timeout

    @property
    def problem(self) -> str:
        """Return why no trial starts without a heartbeat; empty if one may."""
        if not self.is_missing:
            return ''
        return (f'nobody watches over the robot: nothing has come on teleop_heartbeat for '
                f'{self.settings.heartbeat_timeout:g} s; start teleop_node, or set '
                f'heartbeat:=false to try without anybody')
