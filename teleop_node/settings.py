"""What can be set about driving by keys."""

from dataclasses import dataclass
from typing import Final

from control_field.parameters import check_fields, parameter
from msgs_bridge.teaching.driving_settings import DrivingSettings

#: Settings that topics and timers are made from: they hold from start to end.
FIXED: Final = ('topic', 'enable_stamped_cmd_vel', 'lockstep', 'base_frame_id', 'rate', 'keyboard',
                'learner', 'controller')


@dataclass(frozen=True)
class Settings(DrivingSettings):
    """
    Settings of `teleop_node`; see the metadata of each field for unit, range and meaning.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names it.

    """

    topic: str = parameter(
        'cmd_vel_teleop', 'where commands go: cmd_vel_teleop passes the collision monitor of the '
        'controller, cmd_vel goes straight to the robot')
    enable_stamped_cmd_vel: bool = parameter(
        False, 'publish TwistStamped instead of Twist (always in lock-step)')
    lockstep: bool = parameter(
        False, 'stamp commands with the last odometry, so that a simulator that waits for its '
        'answers goes on')
    base_frame_id: str = parameter('base_footprint', 'frame written into stamped commands')
    speed: float = parameter(0.2, 'forward speed of the keys', unit='m/s', low=0.01, high=5.0)
    turn: float = parameter(
        1.0, 'turning rate of the keys', unit='rad/s', low=0.05, high=20.0)
    speed_max: float = parameter(
        0.22, 'greatest speed the keys lead to', unit='m/s', low=0.01, high=5.0)
    turn_max: float = parameter(
        2.84, 'greatest turning rate the keys lead to', unit='rad/s', low=0.05, high=20.0)
    hold_time: float = parameter(
        0.3, 'how long a key counts as held; terminals tell of presses and repeats only',
        unit='s', low=0.1, high=1.0)
    rate: float = parameter(
        20.0, 'commands while a key is held', unit='1/s', low=5.0, high=100.0)
    keyboard: bool = parameter(
        True, 'read keys from the terminal; if not, there are the services alone')
    learner: str = parameter('learner_node', 'name of the learner node')
    controller: str = parameter('control_field_node', 'name of the controller node')

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)
        self.check_driving('topic', 'learner', 'controller')
