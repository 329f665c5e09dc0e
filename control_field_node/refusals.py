"""Why a trial cannot start, and why a place or a local grid does not fit."""

from typing import TYPE_CHECKING

from control_field.grid import Grid
from control_field_node.inputs.observation import Observation

if TYPE_CHECKING:  # the supervisor asks, and is asked
    from control_field_node.inputs.sensing import Sensing
    from control_field_node.supervisor import Supervisor


def why_no_start(supervisor: 'Supervisor', now: float) -> str:
    """
    Return why no trial can start, with the remedy; empty if one can.

    Parameters
    ----------
    supervisor : Supervisor
    now : float, [s]
        On the steady clock.

    """
    trial, field, sensing = supervisor.trial, supervisor.field, supervisor.sensing
    inputs = sensing.inputs
    if trial.run is not None:
        return f'trial {trial.run.trial} is already running'
    if field.current is None or field.current.is_void:
        return f'there is no control field: {field.refusal or "show the way first"}'
    if sensing.pose is None or sensing.odometry_refusal or inputs.odometry.is_stale(now):
        return inputs.odometry.absence(now, 'odometry')
    if sensing.local_grids.newest is None or inputs.local_grid.is_stale(now):
        return inputs.local_grid.absence(now, 'neighbourhood')
    if sensing.localisation.is_lost:
        return _why_lost(sensing, now)
    if problem := supervisor.heartbeat.problem:
        return problem
    return _problem_with_place(field.current.grid, sensing.pose.x, sensing.pose.y)


def _why_lost(sensing: 'Sensing', now: float) -> str:
    """Return why the pose is not known although there is a localisation."""
    poses, what = sensing.inputs.localisation, f'pose on {sensing.settings.pose_topic}'
    if poses.has_come and not poses.is_ignored(now):
        return f'odometry was reset, and no {what} has arrived since'
    return poses.absence(now, what)


def _problem_with_place(grid: Grid, x: float, y: float) -> str:
    """Return that a robot stands outside the workspace, [m]; empty if it does not."""
    if grid.contains(*grid.cell_from_world(x, y)):
        return ''
    return (f'the robot is outside the workspace of the control field, at ({x:.2f}, {y:.2f}) m: '
            f'let it stand there until a larger field has come (about a second, where the '
            f'workspace fits itself), or drive it inside')


def problem_with_observation(observation: Observation, grid: Grid, x: float, y: float) -> str:
    """Return that a local grid does not hold the robot's cell, [m]; empty if it does."""
    row, col = grid.cell_from_world(x, y)
    if abs(observation.row - row) <= 1 and abs(observation.col - col) <= 1:
        return ''
    there = grid.world_from_cell(*observation.cell)
    return (f'neighbourhood: it shows the place around ({there[0]:g}, {there[1]:g}) m, and the '
            f'robot is at ({x:g}, {y:g}) m: its middle must be in the cell of the robot or in one '
            f'beside it')
