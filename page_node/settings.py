"""What can be set about the page."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from control_field.parameters import check_fields, parameter
from msgs_bridge.teaching.driving_settings import DrivingSettings

#: Settings that sockets, topics and timers are made from: they hold from start to end.
FIXED: Final = ('host', 'port', 'token', 'names', 'topic', 'enable_stamped_cmd_vel', 'lockstep',
                'base_frame_id', 'simulation', 'robot_radius', 'bags', 'worlds',
                'learner', 'controller', 'simulator', 'foxglove_port')


@dataclass(frozen=True)
class Settings(DrivingSettings):
    """
    Settings of `page_node`; see the metadata of each field for unit, range and meaning.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names it.

    """

    host: str = parameter(
        '127.0.0.1', 'address to listen on: 127.0.0.1 for this machine alone, 0.0.0.0 for the '
        'whole network, which then needs a token')
    port: int = parameter(8300, 'port to listen on; 0 for any free one', low=0, high=65535)
    token: str = parameter(
        '', 'what the address must contain to get in, as in http://robot:8300/?token=...; empty: '
        'none on this machine alone, else one that is made at each start')
    names: str = parameter(
        '', 'more names of this machine that may stand in the address, separated by blanks, such '
        'as that of a TLS proxy before it')
    topic: str = parameter(
        'cmd_vel_teleop', 'where commands go: cmd_vel_teleop passes the collision monitor of the '
        'controller')
    enable_stamped_cmd_vel: bool = parameter(
        False, 'publish TwistStamped instead of Twist (always in lock-step)')
    lockstep: bool = parameter(
        False, 'stamp commands with the last odometry, so that a simulator that waits for its '
        'answers goes on')
    base_frame_id: str = parameter('base_footprint', 'frame written into stamped commands')
    speed: float = parameter(0.2, 'forward speed of a full push', unit='m/s', low=0.01, high=5.0)
    turn: float = parameter(
        1.0, 'turning rate of a full push', unit='rad/s', low=0.05, high=20.0)
    speed_max: float = parameter(
        0.22, 'greatest speed that can be chosen on the page', unit='m/s', low=0.01, high=5.0)
    turn_max: float = parameter(
        2.84, 'greatest turning rate that can be chosen on the page', unit='rad/s', low=0.05,
        high=20.0)
    simulation: bool = parameter(
        False, 'the robot is simulated: it can be set to places, and its world can be changed')
    robot_radius: float = parameter(
        0.105, 'radius of the body, as it is drawn', unit='m', low=0.01, high=10.0)
    bags: str = parameter('bags', 'folder of the tasks, as that of the learner')
    worlds: str = parameter(
        '', 'folder of the worlds that are drawn or brought along here; empty: worlds, beside the '
        'bags folder')
    foxglove_port: int = parameter(
        0, 'port of a second door, for Foxglove on this machine (doc/page.md); 0: none', low=0,
        high=65535)
    learner: str = parameter('learner_node', 'name of the learner node')
    controller: str = parameter('control_field_node', 'name of the controller node')
    simulator: str = parameter(
        'sim_node', 'name of the simulator node, whose world can be changed')

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)
        self.check_driving('host', 'topic', 'learner', 'controller', 'simulator')

    @property
    def worlds_folder(self) -> str:
        """Return the folder of the worlds that are drawn or brought along here."""
        return self.worlds or str(Path(self.bags).resolve().parent / 'worlds')
