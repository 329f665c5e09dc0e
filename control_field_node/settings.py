"""What can be set about the controller beside the learning parameters: robot, timeouts, topics."""

from dataclasses import dataclass
from typing import Final

from control_field.parameters import check_fields, parameter
from control_field.robot.footprint import footprint_from_text
from control_field.robot.limits import Limits
from control_field.robot.stop_rules import StopRules

#: The learning parameters that decisions depend on; the others are the learner's alone.
DECISION_PARAMETERS: Final = (
    'profile', 'power', 'effective_window', 'learning_rate', 'discount', 'oscillation_limit',
    'step_limit', 'seed', 'corner_cutting', 'unknown_is_blocked', 'moves',
    'rehearsal', 'caution', 'map_memory')

#: Settings that topics and clocks are made from: they hold from start to end.
FIXED: Final = (
    'lockstep', 'enable_stamped_cmd_vel', 'base_frame_id', 'robot_id', 'anchoring', 'pose_topic',
    'slip_std', 'drift_std', 'heading_noise', 'particles')


@dataclass(frozen=True)
class Settings:
    """
    Settings of the controller; see the metadata of each field for unit, range and meaning.

    Raises
    ------
    ValueError
        If a value is of the wrong type or out of range; the message names it.

    """

    lockstep: bool = parameter(
        False, 'answer each odometry exactly once, with its stamp; the simulator waits for it')
    enable_stamped_cmd_vel: bool = parameter(
        False, 'publish and read cmd_vel as TwistStamped instead of Twist (always in lock-step)')
    base_frame_id: str = parameter('base_footprint', 'frame written into stamped commands')
    robot_id: str = parameter('robot', 'hardware_id of trial and diagnostics')
    v_max: float = parameter(
        0.22, 'greatest speed', unit='m/s', low=0.01, high=5.0)
    w_max: float = parameter(
        2.84, 'greatest turning rate', unit='rad/s', low=0.05, high=20.0)
    a_max: float = parameter(
        2.5, 'greatest change of speed', unit='m/s^2', low=0.05, high=20.0)
    alpha_max: float = parameter(
        3.2, 'greatest change of turning rate', unit='rad/s^2', low=0.1, high=50.0)
    robot_radius: float = parameter(
        0.105, 'radius of the body', unit='m', low=0.0, high=2.0)
    footprint: str = parameter(
        '', "outline of a body that is no disc, as Nav2's costmaps take it: [[x, y], ...], [m] "
        'from its middle; empty: the disc of robot_radius')
    arrival_tolerance: float = parameter(
        0.25, 'how far before a centre the next step is decided, in cells', unit='cells',
        low=0.02, high=0.45)
    patience: float = parameter(
        2.0, 'how long the robot waits for what comes into its way before it takes another; 0: '
        'never', unit='s', low=0.0, high=3600.0)
    contact_timeout: float = parameter(
        30.0, 'how long something may touch the robot that it has run into while that stood, '
        'before the trial ends in a collision; 0: every contact is one', unit='s', low=0.0,
        high=3600.0)
    own_cell: bool = parameter(
        True, "stand where the local grid shows the robot's own cell blocked: something reaches "
        'into it; to be switched off for sensors that mark the robot itself')
    mover_speed: float = parameter(
        0.5, 'how fast what has just come into a cell may come nearer: the robot stands before it '
        'can have; 0, and with anchoring or pose_topic: nothing does', unit='m/s', low=0.0,
        high=10.0)
    backs_off: bool = parameter(
        False, 'back off from what comes towards the standing robot, as far as there is room; '
        'else it stands')
    odom_timeout: float = parameter(
        0.5, 'age at which odometry is stale', unit='s', low=0.05, high=60.0)
    neighbourhood_timeout: float = parameter(
        0.5, 'age at which a neighbourhood is stale', unit='s', low=0.05, high=60.0)
    slow_latency: float = parameter(
        0.2, 'time from a command to the arrival of odometry that shows it, from which the robot '
        'drives slower the later it is', unit='s', low=0.01, high=60.0)
    cmd_vel_timeout: float = parameter(
        0.5, 'time without a command after which the base stops by itself', unit='s', low=0.05,
        high=60.0)
    takeover_timeout: float = parameter(
        0.5, 'time without a command of a person after which the trial goes on', unit='s',
        low=0.05, high=60.0)
    heartbeat: bool = parameter(
        False, 'a trial runs only while somebody watches: teleop_heartbeat is heard, which '
        'teleop_node publishes')
    heartbeat_timeout: float = parameter(
        1.0, 'time without a heartbeat after which the trial ends', unit='s', low=0.3, high=60.0)
    pose_jump: float = parameter(
        0.1, 'how far a pose may be off what the robot can drive', unit='m', low=0.0, high=100.0)
    progress_distance: float = parameter(
        0.5, 'a trial is stopped where the robot neither comes so far within progress_time nor '
        'reaches another cell', unit='m', low=0.01, high=100.0)
    progress_time: float = parameter(
        10.0, 'time in which the robot has to come forward (progress_distance)', unit='s', low=0.5,
        high=3600.0)
    stall_time: float = parameter(
        2.0, 'how long the robot may be told to drive without moving', unit='s',
        low=0.2, high=3600.0)
    time_limit: float = parameter(
        3600.0, 'longest trial', unit='s', low=1.0, high=1e6)
    least_coherence: float = parameter(
        0.05, 'coherence below which a field without support says nothing', low=0.0, high=1.0)
    exclusive_cmd_vel: bool = parameter(
        False, 'refuse and stop trials while anybody else has a publisher on cmd_vel, even a '
        'silent one')
    teleop_outside_trials: bool = parameter(
        True, 'pass cmd_vel_teleop on to cmd_vel while no trial runs')
    anchoring: bool = parameter(
        False, 'mend odometry by what the local grid shows against the remembered map')
    pose_topic: str = parameter(
        '', 'PoseWithCovarianceStamped of a localisation, such as amcl_pose, to mend odometry '
        'with; empty: none')
    pose_frame_id: str = parameter(
        'map', 'frame of these poses: its coordinates are those of the workspace')
    slip_std: float = parameter(
        0.04, 'share of their travel that wheels may lose or gain unnoticed, standard deviation',
        low=0.0, high=0.5)
    drift_std: float = parameter(
        0.0175, 'turn that odometry may not notice, standard deviation', unit='rad/m', low=0.0,
        high=1.0)
    heading_noise: float = parameter(
        0.03, 'random error of the heading after a metre, growing with the square root of the way',
        unit='rad', low=0.0, high=1.0)
    wheel_separation: float = parameter(
        0.16, 'distance between the wheels, to tell what a turn on the spot drives them', unit='m',
        low=0.01, high=10.0)
    particles: int = parameter(
        1000, 'particles that stand for where the robot may be', low=50, high=20_000)
    clearance: float = parameter(
        0.06, 'with anchoring or pose_topic: how far off a centre, away from what is blocked, the '
        'robot drives where there is room', unit='m', low=0.0, high=1.0)

    def __post_init__(self) -> None:
        """Validate every value against its declaration."""
        check_fields(self)
        footprint_from_text(self.footprint)
        if self.pose_topic.lstrip('/') == 'tf':
            raise ValueError(f'pose_topic is {self.pose_topic}, must be a topic of poses: '
                             f'localised_odometry_node takes /tf')

    @property
    def has_pose_topic(self) -> bool:
        """Return whether there is a localisation."""
        return bool(self.pose_topic)

    @property
    def mends_odometry(self) -> bool:
        """Return whether odometry is not taken at its word."""
        return self.anchoring or self.has_pose_topic

    @property
    def aside(self) -> float:
        """Return how far off a centre the robot drives beside what is blocked, [m]."""
        return self.clearance if self.mends_odometry else 0.0

    @property
    def limits(self) -> Limits:
        """Return what the robot's body can do."""
        return Limits(self.v_max, self.w_max, self.a_max, self.alpha_max, self.robot_radius,
                      footprint_from_text(self.footprint))

    @property
    def rules(self) -> StopRules:
        """Return the numbers of the stop rules."""
        return StopRules(
            self.odom_timeout, self.neighbourhood_timeout, self.v_max, self.pose_jump,
            self.progress_distance, self.progress_time, self.stall_time, self.time_limit,
            self.w_max)

    @property
    def is_stamped(self) -> bool:
        """Return whether cmd_vel is a TwistStamped."""
        return self.lockstep or self.enable_stamped_cmd_vel
