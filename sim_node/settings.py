"""Every parameter of the simulator, with unit, range and meaning, in one place."""

from dataclasses import dataclass
import math
from typing import Final

from control_field.local_grid import is_local_grid_size, MAX_SIDE, SUBDIVISIONS
from control_field.parameters import check_fields, parameter
from sim_node.robot import Body, Placement, Wheels

#: What topics and clocks are made from: it holds from start to end.
FIXED: Final = ('rate', 'lockstep', 'frame_id', 'child_frame_id', 'enable_stamped_cmd_vel',
                'publish_clock')


@dataclass(frozen=True)
class SimSettings:
    """
    How the simulated robot behaves; see the metadata of each field for unit, range and meaning.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names the parameter, the
        value and the range.

    """

    world: str = parameter(
        'open', 'path of a .yaml (map_server), .map (MovingAI) or image file, or the bare name of '
        'one in config/worlds')
    resolution: float = parameter(
        0.0, "side of the cells; 0: a pixel of the world that holds the robot's disc, else the "
        "smallest multiple of 0.05 m that does. Of an image without a .yaml file: metres a pixel, "
        'which it needs', unit='m', low=0.0, high=1000.0)
    movers: str = parameter(
        '', 'path of a .yaml file with what moves and what changes in the world, or the bare name '
        'of one in config/movers; empty: nothing')
    rate: float = parameter(
        20.0, 'steps of the simulation, each with an odometry and a neighbourhood', unit='1/s',
        low=1.0, high=1000.0)
    speed_factor: float = parameter(
        1.0, 'simulated seconds in a second; of no use in lock-step', low=0.01, high=100.0)
    lockstep: bool = parameter(
        False, 'whether a tick waits for the stamped command that answers the last one')
    start_x: float = parameter(
        0.625, 'where the robot starts; where it cannot stand, in a free cell near by', unit='m',
        low=-1e7, high=1e7)
    start_y: float = parameter(
        0.875, 'where the robot starts; where it cannot stand, in a free cell near by', unit='m',
        low=-1e7, high=1e7)
    start_yaw: float = parameter(
        0.0, 'which way the robot looks at the start', unit='rad', low=-math.tau, high=math.tau)
    robot_radius: float = parameter(0.105, 'radius of the body', unit='m', low=0.01, high=10.0)
    wheel_separation: float = parameter(
        0.160, 'distance between the wheels', unit='m', low=0.01, high=10.0)
    v_max: float = parameter(0.22, 'greatest speed', unit='m/s', low=0.01, high=10.0)
    w_max: float = parameter(2.84, 'greatest turning rate', unit='rad/s', low=0.05, high=50.0)
    a_max: float = parameter(
        0.0, 'greatest change of speed; 0 for no limit', unit='m/s^2', low=0.0, high=100.0)
    alpha_max: float = parameter(
        0.0, 'greatest change of turning rate; 0 for no limit', unit='rad/s^2', low=0.0,
        high=1000.0)
    slip: float = parameter(
        0.0, 'mean share of its travel that a wheel loses, unnoticed by odometry', low=0.0,
        high=0.5)
    heading_drift: float = parameter(
        0.0, 'turn unnoticed by odometry; 1 degree a metre is 0.01745', unit='rad/m', low=-1.0,
        high=1.0)
    noise_std: float = parameter(
        0.0, 'standard deviation of what encoders read, as a share of the travel', low=0.0,
        high=1.0)
    sight_cells: int = parameter(
        3, 'side of the local grid, odd; from 5 on what stands behind something is not seen',
        unit='cells', low=3, high=MAX_SIDE)
    sight_range: float = parameter(
        0.0, 'what lies farther away is not seen, but for the cells around the robot; 0 for no '
        'limit', unit='m', low=0.0, high=1000.0)
    sight_subdivision: int = parameter(
        0, 'finer cells along a side of each cell of the local grid: they show where in a cell '
        'something is; 1, 3 or 5, or 0: 5 where cells are made of smaller pixels, else 1', low=0,
        high=SUBDIVISIONS[-1])
    sight_flips: float = parameter(
        0.0, 'share of the cells it sees that are shown wrongly, at random in each tick: free as '
        'occupied, and the other way round', low=0.0, high=0.5)
    seed: int = parameter(
        0, 'seed of slip, noise, wrong cells and what moves at random', low=0, high=2**63 - 1)
    frame_id: str = parameter('odom', 'frame of odometry, neighbourhood and map')
    child_frame_id: str = parameter('base_footprint', "frame of the robot's body")
    cmd_vel_timeout: float = parameter(
        0.5, 'simulated time without a command after which the robot stops', unit='s', low=0.05,
        high=60.0)
    enable_stamped_cmd_vel: bool = parameter(
        False, 'read cmd_vel as TwistStamped instead of Twist (always in lock-step)')
    publish_clock: bool = parameter(
        True, 'whether stamps count from the start on and /clock tells them (always in '
        "lock-step); if not, stamps are the system's time")

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)
        for name in ('world', 'frame_id', 'child_frame_id'):
            if not getattr(self, name).strip():
                raise ValueError(f'{name} is empty, must be a name')
        if not is_local_grid_size(self.sight_cells):
            raise ValueError(f'sight_cells is {self.sight_cells}, must be odd')
        if self.sight_subdivision not in (0, *SUBDIVISIONS):
            raise ValueError(f'sight_subdivision is {self.sight_subdivision}, must be 0, 1, 3 or '
                             f'5')

    @property
    def is_stamped(self) -> bool:
        """Return whether cmd_vel is a TwistStamped."""
        return self.lockstep or self.enable_stamped_cmd_vel

    @property
    def has_clock(self) -> bool:
        """Return whether time is simulated and published."""
        return self.lockstep or self.publish_clock

    @property
    def body(self) -> Body:
        """Return the parameters of the robot's body."""
        return Body(self.robot_radius, self.v_max, self.w_max, self.wheel_separation,
                    self.a_max, self.alpha_max)

    @property
    def wheels(self) -> Wheels:
        """Return the parameters of the robot's odometry."""
        return Wheels(self.slip, self.heading_drift, self.noise_std)

    @property
    def start(self) -> Placement:
        """Return where the robot starts."""
        return Placement(self.start_x, self.start_y, self.start_yaw)
