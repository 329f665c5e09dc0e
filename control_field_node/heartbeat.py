"""Whether somebody watches over the robot: a heartbeat that must not fall silent. ROS-free."""

import math
from typing import Final

from control_field_node.settings import Settings

#: Most that one look after another counts for, [s]: while this process is held up, what has come
#: meanwhile waits, and is no silence.
_LONGEST_LOOK: Final = 0.3


class Heartbeat:
    """
    The heartbeat of whoever watches over trials.

    Parameters
    ----------
    settings : Settings
        Whether one is needed, and how long it may be silent.

    """

    def __init__(self, settings: Settings) -> None:
        """Start with none."""
        self.settings = settings
        self._silent = math.inf
        self._looked = -math.inf

    def saw(self) -> None:
        """Take in that it has come."""
        self._silent = 0.0

    def look(self, now: float) -> None:
        """Take in that time passes; call it about every 0.1 s."""
        self._silent += min(max(now - self._looked, 0.0), _LONGEST_LOOK)
        self._looked = now

    @property
    def is_missing(self) -> bool:
        """Tell whether one is needed and has been silent for too long, or never come."""
        return self.settings.heartbeat and self._silent > self.settings.heartbeat_timeout

    @property
    def problem(self) -> str:
        """Say why no trial starts without it; empty where one may."""
        if not self.is_missing:
            return ''
        return (f'nobody watches over the robot: nothing has come on teleop_heartbeat for '
                f'{self.settings.heartbeat_timeout:g} s; start teleop_node, or set '
                f'heartbeat:=false to try without anybody')
