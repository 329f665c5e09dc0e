"""Every parameter of the simulator, with unit, range and meaning, in one place."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, Field, fields
import math
from typing import Any, NamedTuple

from sim_node.robot import Body, Placement, Wheels


def _parameter(
    default: Any, meaning: str, *, unit: str = '1', low: float = -math.inf, high: float = math.inf,
    fixed: bool = False, name: str = '',
) -> Any:
    """Declare a parameter; the range is closed at both ends."""
    return field(default=default, metadata={
        'meaning': meaning, 'unit': unit, 'low': low, 'high': high, 'fixed': fixed, 'name': name})


class Declaration(NamedTuple):
    """What ROS has to know of a parameter; ``fixed`` ones are set at start only."""

    name: str
    default: Any
    meaning: str
    unit: str
    low: float
    high: float
    fixed: bool


@dataclass(frozen=True)
class SimParameters:
    """
    How the simulated robot behaves; see the metadata of each field for unit, range and meaning.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names the parameter, the
        value and the range.

    """

    world: str = _parameter(
        'open', 'path of a .yaml (map_server) or .map (MovingAI) file, or the bare name of one in '
        'config/worlds')
    rate: float = _parameter(20.0, 'ticks', unit='1/s', low=1.0, high=1000.0, fixed=True)
    speed_factor: float = _parameter(
        1.0, 'simulated seconds in a second; of no use in lock-step', low=0.01, high=100.0)
    lockstep: bool = _parameter(
        False, 'whether a tick waits for the stamped command that answers the last one',
        fixed=True)
    start_x: float = _parameter(
        0.625, 'where the robot starts', unit='m', low=-1e7, high=1e7, name='start.x')
    start_y: float = _parameter(
        0.875, 'where the robot starts', unit='m', low=-1e7, high=1e7, name='start.y')
    start_yaw: float = _parameter(
        0.0, 'which way the robot looks at the start', unit='rad', low=-math.tau, high=math.tau,
        name='start.yaw')
    radius: float = _parameter(
        0.105, 'radius of the robot', unit='m', low=0.01, high=10.0, name='robot.radius')
    max_speed: float = _parameter(
        0.22, 'greatest speed', unit='m/s', low=0.0, high=10.0, name='robot.max_speed')
    max_turn_rate: float = _parameter(
        2.84, 'greatest turning speed', unit='rad/s', low=0.0, high=50.0,
        name='robot.max_turn_rate')
    wheel_separation: float = _parameter(
        0.160, 'distance between the wheels', unit='m', low=0.01, high=10.0,
        name='robot.wheel_separation')
    max_acceleration: float = _parameter(
        0.0, 'greatest acceleration; 0 for no limit', unit='m/s^2', low=0.0, high=100.0,
        name='robot.max_acceleration')
    max_turn_acceleration: float = _parameter(
        0.0, 'greatest turning acceleration; 0 for no limit', unit='rad/s^2', low=0.0,
        high=1000.0, name='robot.max_turn_acceleration')
    slip: float = _parameter(
        0.0, 'mean share of its travel that a wheel loses, unnoticed by odometry', low=0.0,
        high=0.5)
    heading_drift: float = _parameter(
        0.0, 'turn unnoticed by odometry', unit='rad/m', low=-1.0, high=1.0)
    noise_std: float = _parameter(
        0.0, 'standard deviation of what encoders read, as a share of the travel', low=0.0,
        high=1.0)
    seed: int = _parameter(0, 'seed of slip and noise', low=0, high=2**63 - 1)
    frame_id: str = _parameter('odom', 'frame of odometry, neighbourhood and map', fixed=True)
    child_frame_id: str = _parameter('base_footprint', "frame of the robot's body", fixed=True)
    cmd_vel_timeout: float = _parameter(
        1.0, 'simulated time without a command after which the robot stops', unit='s', low=0.05,
        high=60.0)
    enable_stamped_cmd_vel: bool = _parameter(
        False, 'whether cmd_vel is a TwistStamped instead of a Twist', fixed=True)
    publish_clock: bool = _parameter(
        True, 'whether stamps count from the start on and /clock tells them; if not, stamps are '
        "the system's time", fixed=True)

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        for spec in fields(self):
            object.__setattr__(self, spec.name, _checked(spec, getattr(self, spec.name)))
        if self.lockstep and not self.enable_stamped_cmd_vel:
            raise ValueError('lockstep is true, which needs enable_stamped_cmd_vel: true (a tick '
                             'is answered by the stamp of its command)')

    @classmethod
    def from_ros(cls, values: Mapping[str, Any]) -> 'SimParameters':
        """
        Build from ROS parameter names and values; what is not named keeps its default.

        Raises
        ------
        ValueError
            As the constructor does.

        """
        names = {_ros_name(spec): spec.name for spec in fields(cls)}
        return cls(**{names[name]: value for name, value in values.items() if name in names})

    @classmethod
    def declarations(cls) -> Iterator[Declaration]:
        """Iterate over what has to be declared to ROS."""
        for spec in fields(cls):
            meta = spec.metadata
            yield Declaration(_ros_name(spec), spec.default, meta['meaning'], meta['unit'],
                              meta['low'], meta['high'], meta['fixed'])

    @property
    def body(self) -> Body:
        """Return the parameters of the robot's body."""
        return Body(self.radius, self.max_speed, self.max_turn_rate, self.wheel_separation,
                    self.max_acceleration, self.max_turn_acceleration)

    @property
    def wheels(self) -> Wheels:
        """Return the parameters of the robot's odometry."""
        return Wheels(self.slip, self.heading_drift, self.noise_std)

    @property
    def start(self) -> Placement:
        """Return where the robot starts."""
        return Placement(self.start_x, self.start_y, self.start_yaw)


def _ros_name(spec: 'Field[Any]') -> str:
    return spec.metadata['name'] or spec.name


def _checked(spec: 'Field[Any]', value: Any) -> Any:
    """Return the value as its declared type (a whole number may stand for a float)."""
    kind, name, meta = type(spec.default), _ros_name(spec), spec.metadata
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if type(value) is not kind:
        raise ValueError(f'{name} is {value!r}, must be of type {kind.__name__}')
    if kind in (int, float) and not meta['low'] <= value <= meta['high']:
        raise ValueError(
            f'{name} is {value}, must be between {meta["low"]} and {meta["high"]} '
            f'[{meta["unit"]}]')
    if kind is str and not value.strip():
        raise ValueError(f'{name} is empty, must be a name')
    return value
