"""From where the field leads to the goal, before and after the trials."""

from collections.abc import Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
import numpy.typing as npt

from control_field.records import ControlField
from control_field.words import counted
from experience_cli.demo.report import TaskReport, TrialReport
from experience_cli.figures.drawing import (
    BASIN, DEMONSTRATED, draw_cells, draw_field, draw_frame, draw_goal, draw_history, draw_legend,
    draw_path, new_figure, PATH, SINK, WALL)

#: Cells from which the flow ends somewhere else.
_LOST: Final = '#f6dcdc'
_FIRST: Final = '#5b3f8c'


def before_and_after_figure(report: TaskReport) -> Figure:
    """Draw the field in the true world after the demonstration, and after the last trial."""
    figure = new_figure(13.0, 8.0)
    before, after = figure.subplots(1, 2)
    n_trials = len(report.trials)
    _draw_side(before, report, 'After the demonstration', report.demonstrated.field, report.home)
    draw_path(before, report.demonstration, 'demonstration', DEMONSTRATED)
    if report.trials:
        first, last = report.trials[0], report.trials[-1]
        _draw_trial(before, first, _FIRST)
        _draw_side(after, report, f'After {counted(n_trials, "trial")}', report.final.field,
                   last.home)
        _draw_trial(after, last, PATH)
    else:
        after.set_axis_off()
    draw_legend(figure)
    others = report.other_starts
    figure.suptitle(
        f'{report.name}: what the field knows by itself. With its 3x3 local grid the robot then '
        f'reached the goal from {others["reached"]} of {others["starts"]} other starts.',
        fontsize=11.5)
    return figure


def _draw_side(
    axes: Axes, report: TaskReport, when: str, field: ControlField, home: npt.NDArray[np.bool_],
) -> None:
    grid, reachable = field.grid, report.reachable
    n_home = int((home & reachable).sum())
    draw_frame(axes, grid, f'{when}: the arrows lead to the goal\n'
                           f'from {n_home} of {int(reachable.sum())} places')
    blocked = report.world.occupancy == 100
    draw_cells(axes, grid, home & ~blocked, BASIN, 'the arrows lead to the goal')
    draw_cells(axes, grid, reachable & ~home, _LOST, 'they lead elsewhere')
    draw_cells(axes, grid, blocked, WALL, 'wall')
    draw_field(axes, field, blocked)
    draw_goal(axes, field)


def _draw_trial(axes: Axes, trial: TrialReport, colour: str) -> None:
    draw_path(axes, trial.path, f'trial {trial.trial}: {counted(trial.steps, "step")}, '
                                f'{counted(trial.reinforcements, "reinforcement")}', colour)
    if len(trial.corrected):
        xy = np.unique(trial.corrected, axis=0)
        axes.plot(xy[:, 0], xy[:, 1], marker='X', markersize=9, color=SINK, linestyle='none',
                  markeredgecolor='white', label='here the robot saw a wall ahead', zorder=3.2)


def learning_figure(reports: Sequence[TaskReport]) -> Figure:
    """Draw from how many places the field alone leads to the goal, by trial, for all tasks."""
    figure = new_figure(6.4, 4.2)
    axes = figure.add_subplot()
    draw_history(axes, [(report.name, [100.0 * share for share in report.field_success()])
                        for report in reports], 'places [%]', first=0)
    axes.set_ylim(0.0, 105.0)
    axes.set_yticks(range(0, 101, 20))
    axes.set_xlabel('trial (0: after the demonstration)')
    axes.set_title('Places from which the field alone leads to the goal', loc='left', fontsize=11,
                   fontweight='bold')
    return figure
