"""What parameter files of ROS say of a robot: Nav2's, and those of its controllers."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from control_field.robot.footprint import footprint_from_text
from experience_cli.errors import UserError
from experience_cli.robot.drive import check_drive
from experience_cli.robot.facts import Facts
from msgs_bridge.untrusted.files import read_text
from msgs_bridge.untrusted.yaml_texts import yaml_from_text

_PARAMETERS: Final = 'ros__parameters'
#: Parameters of Nav2's controllers (DWB, regulated pure pursuit, MPPI, graceful) that limit.
_LIMITS: Final = {
    'max_vel_x': 'v_max', 'max_speed_xy': 'v_max', 'desired_linear_vel': 'v_max',
    'max_linear_vel': 'v_max', 'vx_max': 'v_max', 'v_linear_max': 'v_max',
    'max_vel_theta': 'w_max', 'wz_max': 'w_max', 'v_angular_max': 'w_max',
    'max_angular_vel': 'w_max', 'rotate_to_heading_angular_vel': 'w_max',
    'acc_lim_x': 'a_max', 'decel_lim_x': 'a_max', 'ax_max': 'a_max', 'ax_min': 'a_max',
    'acc_lim_theta': 'alpha_max', 'decel_lim_theta': 'alpha_max', 'az_max': 'alpha_max',
    'max_angular_accel': 'alpha_max'}
#: Lists of the velocity smoother: ahead, sideways, turning.
_SMOOTHER: Final = {'max_velocity': ('v_max', 'w_max'), 'max_accel': ('a_max', 'alpha_max'),
                    'max_decel': ('a_max', 'alpha_max')}
#: Of a diff_drive_controller: velocity and acceleration, ahead and turning.
_DRIVE: Final = {
    'linear.x': ('v_max', 'a_max'), 'angular.z': ('w_max', 'alpha_max')}
_FRAMES: Final = {
    'robot_base_frame': 'base_frame', 'base_frame_id': 'base_frame', 'odom_frame_id': 'odom_frame',
    'base_frame': 'base_frame'}
_NODES: Final = ('amcl', 'costmap', 'velocity_smoother', 'controller_server', 'collision_monitor',
                 'behavior_server', 'bt_navigator', 'slam_toolbox', 'docking_server')


def add_parameter_file(path: Path, facts: Facts) -> None:
    """
    Note what a parameter file says of a robot.

    Raises
    ------
    UserError
        If it is none, says nothing of a robot, or is one that drives otherwise.
    OSError
        If it cannot be read.

    """
    before = _n_measures(facts)
    for node, values in sections_of(_content_of(path)):
        _add_node(path, node.rpartition('/')[2], values, facts)
    if _n_measures(facts) == before:
        raise UserError(f'{path}: says nothing of how large or fast a robot is: it must be a '
                        f'parameter file of Nav2 or of ros2_control, with controller_server, '
                        f'velocity_smoother, a costmap or a diff_drive_controller in it')


def node_parameters(path: Path) -> dict[str, dict[str, Any]]:
    """Return what a parameter file says of each node; raises as `add_parameter_file` does."""
    return {node.rpartition('/')[2]: values for node, values in sections_of(_content_of(path))}


def _content_of(path: Path) -> Any:
    text = read_text(path, errors='replace')
    if text.lstrip().startswith('<'):
        raise UserError(f'{path}: is XML: `experience robot from-urdf {path}` reads a URDF')
    try:
        return yaml_from_text(text)
    except ValueError as error:
        raise UserError(f'{path}: {error}') from None


def _n_measures(facts: Facts) -> int:
    return sum(len(facts.said.get(name, ())) for name in (
        'footprint', 'radius', 'v_max', 'w_max', 'a_max', 'alpha_max', 'wheel_separation'))


def sections_of(content: Any, name: str = '') -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the nodes of a parameter file, with their parameters; names within names joined."""
    if not isinstance(content, dict):
        return
    for key, value in content.items():
        if key == _PARAMETERS and isinstance(value, dict):
            yield name, dict(_flat(value))
        else:
            yield from sections_of(value, str(key))


def _flat(values: dict[Any, Any], before: str = '') -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f'{before}{key}.')
        else:
            yield f'{before}{key}', value


def _add_node(path: Path, node: str, values: dict[str, Any], facts: Facts) -> None:
    _check_motion(path, node, values, facts)
    if 'left_wheel_names' in values or 'wheel_separation' in values:
        _add_drive_controller(node, values, facts)
    elif any(word in node for word in _NODES):
        _add_navigation(path, node, values, facts)


def _check_motion(path: Path, node: str, values: dict[str, Any], facts: Facts) -> None:
    """Refuse robots that are not driven by wheels on two sides."""
    for name, value in values.items():
        last, where = name.rpartition('.')[2], f'{path}: {node}, {name}'
        if last == 'motion_model' or (last == 'type' and 'controller' in node):
            check_drive(str(value), where)
        if last == 'robot_model_type' and 'omni' in str(value).lower():
            facts.notes.append(f'{where} is {value}: for a differential drive it is '
                               f'nav2_amcl::DifferentialMotionModel')
        sideways = value if last in ('max_vel_y', 'max_velocity_y') else (
            value[1] if last == 'max_velocity' and node == 'velocity_smoother'
            and isinstance(value, list) and len(value) == 3 else 0)
        if isinstance(sideways, (int, float)) and sideways:
            raise UserError(f'{where} lets it drive sideways ({sideways:g} m/s); only robots with '
                            f'a differential drive (wheels on two sides) can be taught')


def _add_drive_controller(node: str, values: dict[str, Any], facts: Facts) -> None:
    def said(name: str) -> str:
        return f'{node}, {name}'

    for name in ('wheel_separation', 'wheel_radius'):
        times = values.get(f'{name}_multiplier', 1.0)
        value = values.get(name)
        if isinstance(value, (int, float)) and isinstance(times, (int, float)):
            facts.add_positive(name, value * times, said(name))
    for axis, (speed, change) in _DRIVE.items():
        facts.add_positive(speed, values.get(f'{axis}.max_velocity'), said(f'{axis}.max_velocity'))
        for name in ('max_acceleration', 'min_acceleration', 'max_deceleration'):
            facts.add_positive(change, values.get(f'{axis}.{name}'), said(f'{axis}.{name}'))
    _add_frames(node, values, facts)
    facts.add_positive('cmd_vel_timeout', values.get('cmd_vel_timeout'), said('cmd_vel_timeout'))
    if 'use_stamped_vel' in values:
        facts.add('stamped', bool(values['use_stamped_vel']), said('use_stamped_vel'))


def _add_navigation(path: Path, node: str, values: dict[str, Any], facts: Facts) -> None:
    for name, value in values.items():
        last, source = name.rpartition('.')[2], f'{node}, {name}'
        if last in _LIMITS and node == 'controller_server':
            facts.add_positive(_LIMITS[last], value, source)
        elif name in _SMOOTHER and node == 'velocity_smoother' and isinstance(value, list):
            for ours, each in zip(_SMOOTHER[name], value[:1] + value[-1:], strict=False):
                facts.add_positive(ours, each, source)
        elif name == 'enable_stamped_cmd_vel':
            facts.add('stamped', bool(value), source)
        elif name == 'scan_topic':
            facts.add('scan_topic', str(value).lstrip('/') or None, source)
    if 'costmap' in node:
        _add_costmap(path, node, values, facts)
    _add_frames(node, values, facts)


def _add_frames(node: str, values: dict[str, Any], facts: Facts) -> None:
    for name, ours in _FRAMES.items():
        facts.add(ours, str(values.get(name, '')).lstrip('/') or None, f'{node}, {name}')


def _add_costmap(path: Path, node: str, values: dict[str, Any], facts: Facts) -> None:
    text = values.get('footprint')
    try:
        outline = footprint_from_text(text) if isinstance(text, str) and text != '[]' else None
    except ValueError as error:
        raise UserError(f'{path}: {node}: {error}') from None
    if outline is not None:
        facts.add('footprint', outline.corners, f'{node}, footprint')
    facts.add_positive('radius', values.get('robot_radius'), f'{node}, robot_radius')
    for name, value in values.items():
        layer, _, last = name.rpartition('.')
        if last == 'topic' and values.get(f'{layer}.data_type') == 'LaserScan':
            facts.add('scan_topic', str(value).lstrip('/') or None, f'{node}, {name}')
            facts.add_positive('traced', values.get(f'{layer}.raytrace_max_range'),
                               f'{node}, {layer}.raytrace_max_range')
