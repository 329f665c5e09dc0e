"""What the controller publishes in answer to what arrived."""

from dataclasses import dataclass
from typing import Final

from control_field.robot.limits import STANDSTILL, Velocity
from control_field_node.trial_run import Rows


@dataclass(frozen=True, slots=True)
class Answer:
    """
    What to publish.

    Parameters
    ----------
    velocity : tuple of float or None, [m/s] and [rad/s]
        For `cmd_vel`; None: nothing.
    rows : tuple of ndarray of DECISION_DTYPE
        For `experience`, a message each.
    requested : tuple of float or None
        What the field wanted, where the collision monitor let something else through.

    """

    velocity: Velocity | None = None
    rows: tuple[Rows, ...] = ()
    requested: Velocity | None = None


NOTHING: Final = Answer()
STOP: Final = Answer(STANDSTILL)
