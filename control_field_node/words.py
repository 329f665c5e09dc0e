"""What the controller says of a goal, a place or a local grid that does not fit."""

from collections.abc import Sequence
from typing import Final

from control_field.grid import Grid
from control_field.records import ControlField
from control_field.robot.stop_rules import StopReason
from control_field_node.seen import Seen
from msgs_bridge.messages.memory_identity import task_of
from msgs_bridge.messages.poses import problem_with_frame

#: Of a person's commands before there is anything to judge them by.
UNMONITORED: Final = ('no usable odometry or no usable neighbourhood has come yet: only the '
                      'limits of speed hold')
#: Of a goal that was demonstrated.
LEADS_THERE: Final = 'goal_pose: the control field leads there; ~/start_trial starts'


def person(names: Sequence[str], topic: str) -> str:
    """Say who may have sent what came on a topic; nothing where nobody is known."""
    if not names:
        return ''
    return f'{"one of " if len(names) > 1 else ""}{", ".join(names)} on {topic}'


def idle_sender(names: Sequence[str], topic: str) -> str:
    """Say that somebody sends standstill to the robot all the time, and what to do."""
    return (f'{person(names, topic) or topic}: standstill is sent without anybody driving. That '
            f'takes no trial over, but the robot obeys it between our commands: end that '
            f'program, or have it publish on cmd_vel_teleop')


def of_field(field: ControlField) -> str:
    """Say which control field has come."""
    task = task_of(field.memory)
    said = f'control field revision {field.revision}' + (f' of task {task}' if task else '')
    return said if field.revision else f'{said}: it is empty, nothing was learnt yet'


def is_of_another_task(field: ControlField, other: ControlField) -> bool:
    """Tell whether two fields say that they are of different tasks."""
    tasks = {task_of(field.memory), task_of(other.memory)} - {''}
    return len(tasks) == 2


def why_idle(field: ControlField | None, refusal: str) -> tuple[str, StopReason | None]:
    """Say why no trial can be started, with the reason's name; nothing if one can be."""
    if field is not None and not field.is_void:
        return '', None
    reason = StopReason.WRONG_FIELD if refusal else StopReason.NO_FIELD
    return reason.told(refusal), reason


def problem_with_goal(
    field: ControlField | None, x: float, y: float, frame_id: str,
) -> str:
    """Say why the robot will not drive to a point, [m]; empty where the field leads there."""
    if field is None or field.is_void:
        return 'goal_pose: there is no control field yet'
    if problem := problem_with_frame(frame_id, field.grid.frame_id, 'goal_pose'):
        return f'{problem}: choose that as the fixed frame of what it is clicked in'
    if field.grid.cell_from_world(x, y) == field.goal:
        return ''
    there = field.grid.world_from_cell(*field.goal)
    return (f'goal_pose: the control field leads to ({there[0]:g}, {there[1]:g}) m only; '
            f'demonstrate the way to ({x:g}, {y:g}) m')


def problem_with_local_grid(seen: Seen, grid: Grid, x: float, y: float) -> str:
    """Say that a local grid does not hold the robot's cell, [m]; empty if it does."""
    cell = grid.cell_from_world(x, y)
    if abs(seen.row - cell[0]) <= 1 and abs(seen.col - cell[1]) <= 1:
        return ''
    there = grid.world_from_cell(seen.row, seen.col)
    return (f'neighbourhood: it shows the place around ({there[0]:g}, {there[1]:g}) m, and the '
            f'robot is at ({x:g}, {y:g}) m: its middle must be in the cell of the robot or in one '
            f'beside it')


def problem_with_place(grid: Grid, x: float, y: float) -> str:
    """Say that a robot stands outside the workspace, [m]; empty if it does not."""
    if grid.contains(*grid.cell_from_world(x, y)):
        return ''
    return f'the robot is outside the workspace, at ({x:g}, {y:g}) m'
