"""What can be set about the node that makes neighbourhoods: workspace, sensor, body."""

from dataclasses import dataclass
import math
from typing import Final

from control_field.grid import default_lattice, Grid
from control_field.local_grid import is_local_grid_size, MAX_SIDE, SUBDIVISIONS
from control_field.parameters import check_fields, parameter
from control_field.robot.footprint import footprint_from_text
from msgs_bridge.node.workspace_settings import check_workspace, set_workspace, side_of_cells
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.sensing.local_grid_from_scan import Body, Extent

#: Settings that topics and cells are made from: they hold from start to end.
FIXED: Final = ('source', 'frame_id', 'rows', 'cols', 'resolution', 'origin_x', 'origin_y')


@dataclass(frozen=True)
class NeighbourhoodSettings:
    """
    Settings of `neighbourhood_node`; see the metadata of each field for unit, range and meaning.

    The workspace is named as the learner names it: one parameter file does for both.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names it.

    """

    source: str = parameter(
        'scan', 'scan: LaserScan on `scan`; costmap: OccupancyGrid on `costmap`',
        choices=('scan', 'costmap'))
    frame_id: str = parameter('odom', 'frame of the workspace, of odometry and of the costmap')
    rows: int = parameter(
        0, 'rows of a workspace outside of which everything is blocked; 0: there are no bounds',
        unit='cells', low=0, high=2000)
    cols: int = parameter(0, 'its columns, likewise', unit='cells', low=0, high=2000)
    resolution: float = parameter(
        0.0, 'side of a cell; 0: without bounds the cells of the learner or the simulator beside '
        'this node, else by robot_radius, the smallest multiple of 0.05 m that holds the robot '
        'with 2 cm to spare on each side', unit='m', low=0.0, high=100.0)
    origin_x: float = parameter(
        0.0, 'x of the lower left corner of the workspace; without bounds (0, 0) is the centre of '
        'a cell', unit='m', low=-1e7, high=1e7)
    origin_y: float = parameter(
        0.0, 'y of that corner', unit='m', low=-1e7, high=1e7)
    timeout: float = parameter(
        0.5, 'age of scan or costmap, by its stamp, from which nothing is known', unit='s',
        low=0.05, high=60.0)
    sight_cells: int = parameter(
        3, 'side of the neighbourhood, odd; from 5 on what is seen farther away is remembered, '
        'while decisions go by the 3 x 3 in its middle', unit='cells', low=3, high=MAX_SIDE)
    sight_range: float = parameter(
        0.0, 'what lies farther away is not looked at, but for the cells around the robot; 0: as '
        'far as scan or costmap show anything', unit='m', low=0.0, high=1000.0)
    sight_subdivision: int = parameter(
        1, 'finer cells along a side of each cell of the neighbourhood: they show where in a cell '
        'something is; 1, 3 or 5', low=SUBDIVISIONS[0], high=SUBDIVISIONS[-1])
    robot_radius: float = parameter(
        0.105, 'radius of the disc that fits into a free cell: the body, or what is taken for it',
        unit='m', low=0.0, high=2.0)
    footprint: str = parameter(
        '', 'outline of a body that is no disc: [[x, y], ...], [m] from its middle; returns on it '
        "are the robot's own; empty: those in the disc of robot_radius are")
    seen_share: float = parameter(
        0.5, 'share of a cell that must be seen before it is called free', low=0.01, high=1.0)
    laser_x: float = parameter(
        0.0, 'where the laser sits, ahead of the middle of the robot', unit='m', low=-10.0,
        high=10.0)
    laser_y: float = parameter(
        0.0, 'where the laser sits, left of the middle of the robot', unit='m', low=-10.0,
        high=10.0)
    laser_z: float = parameter(
        0.0, 'where the laser sits, above the floor; 0 where that is not known (only a tilted one '
        'needs it, to tell the floor from what stands on it)', unit='m', low=0.0, high=10.0)
    laser_roll: float = parameter(
        0.0, 'how the laser is turned about the x axis of the robot; pi is upside down, left and '
        'right are swapped then. Tilted by more than 10 degrees it is refused', unit='rad',
        low=-math.tau, high=math.tau)
    laser_pitch: float = parameter(
        0.0, 'how the laser is turned about the y axis of the robot, after its roll', unit='rad',
        low=-math.tau, high=math.tau)
    laser_yaw: float = parameter(
        0.0, 'which way the laser looks: how it is turned about the z axis, after roll and pitch',
        unit='rad', low=-math.tau, high=math.tau)
    accuracy: float = parameter(
        0.02, 'how far a range may be off; what is so near before the edge of a cell is taken to '
        'lie beyond it', unit='m', low=0.0, high=1.0)
    zero_is_no_return: bool = parameter(
        False, 'the driver writes 0 where it measured nothing up to the greatest range (against '
        'REP-117, where 0 says nothing)')
    lethal_threshold: int = parameter(
        65, 'least value of a costmap that blocks; for an inflated one 100, which is where '
        'something really is', low=1, high=100)

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)
        check_workspace(self)
        footprint_from_text(self.footprint)
        if not is_local_grid_size(self.sight_cells):
            raise ValueError(f'sight_cells is {self.sight_cells}, must be odd')
        if self.sight_subdivision not in SUBDIVISIONS:
            raise ValueError(f'sight_subdivision is {self.sight_subdivision}, must be 1, 3 or 5')
        if self.laser.problem:
            raise ValueError(f'laser_roll and laser_pitch: {self.laser.problem}')

    @property
    def grid(self) -> Grid:
        """Return the workspace; without bounds one cell of the lattice."""
        return set_workspace(self) or default_lattice(side_of_cells(self), self.frame_id)

    @property
    def follows(self) -> bool:
        """Return whether the cells are those that others have, where these say any."""
        return not (self.rows or self.resolution)

    @property
    def is_bounded(self) -> bool:
        """Return whether what lies outside the workspace is blocked."""
        return self.rows > 0

    @property
    def laser(self) -> Mount:
        """Return where the laser sits on the robot."""
        return Mount(self.laser_x, self.laser_y, self.laser_yaw, self.laser_z, self.laser_roll,
                     self.laser_pitch)

    @property
    def extent(self) -> Extent:
        """Return how much a neighbourhood shows."""
        return Extent(self.sight_cells, self.sight_subdivision, self.sight_range or math.inf)

    @property
    def body(self) -> Body:
        """Return the robot's size, and how far a scan is trusted."""
        return Body(self.robot_radius, self.accuracy, self.seen_share,
                    footprint_from_text(self.footprint))
