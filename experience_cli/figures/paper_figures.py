"""The paper's figures 2 to 7, and what was learnt, from the reports of a demo."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from control_field.records import Outcome
from experience_cli.demo.report import TaskReport
from experience_cli.figures.drawing import (
    DEMONSTRATED, draw_cells, draw_field, draw_frame, draw_goal, draw_history, draw_legend,
    draw_movers, draw_path, draw_prototypes, new_figure, WALL)
from experience_cli.figures.learning_figures import before_and_after_figure, learning_figure
from experience_cli.output import write_output

#: Numbers of the figures of final fields, one a task.
_FINALS = (3, 4)
#: Number of the figure, what it counts, and its name in a trial's report.
_HISTORIES = (
    (5, 'steps to the goal', 'steps'),
    (6, 'hidden neurons', 'hidden_neurons'),
    (7, 'reinforcements', 'reinforcements'),
)


def draw_figures(out: Path, reports: Sequence[TaskReport]) -> list[Path]:
    """
    Write ``figure_2.png`` to ``figure_7.png`` and the rest into a folder; return the paths.

    Raises
    ------
    UserError
        If one cannot be written; what was there before then stays.

    """
    paths = []
    for name, figure in figures_of(reports):
        paths.append(out / f'{name}.png')
        write_output(paths[-1], partial(figure.savefig, format='png'))
    return paths


def figures_of(reports: Sequence[TaskReport]) -> Iterator[tuple[str, Figure]]:
    """Draw the figures, each with the name of its file."""
    yield 'figure_2', demonstrated_figure(reports[0])
    for number, report in zip(_FINALS, reports, strict=False):
        yield f'figure_{number}', final_figure(f'Figure {number}  ', report)
    # Beside the paper's two tasks there may be others, which its numbers do not fit.
    for report in reports[len(_FINALS):]:
        yield f'figure_{report.name}', final_figure('', report)
    for number, what, field in _HISTORIES:
        yield f'figure_{number}', history_figure(number, what, field, reports)
    for report in reports:
        yield f'learning_{report.name}', before_and_after_figure(report)
    yield 'learning', learning_figure(reports)


def demonstrated_figure(report: TaskReport) -> Figure:
    """Draw what the demonstration alone has made: figure 2."""
    figure = new_figure()
    axes = figure.add_subplot()
    refresh = report.demonstrated
    draw_frame(axes, refresh.field.grid, 'Figure 2  Demonstrated control field')
    draw_field(axes, refresh.field)
    draw_prototypes(axes, refresh.field.grid, refresh)
    draw_path(axes, report.demonstration, 'demonstration', DEMONSTRATED)
    draw_goal(axes, refresh.field)
    draw_legend(figure)
    return figure


def final_figure(number: str, report: TaskReport) -> Figure:
    """Draw the final field with the true map and the way of the last trial: figures 3 and 4."""
    figure = new_figure()
    axes = figure.add_subplot()
    refresh = report.final
    grid = refresh.field.grid
    draw_frame(axes, grid, f'{number}Final control field of {report.name}')
    blocked = report.world.occupancy == 100
    draw_cells(axes, grid, blocked, WALL, 'wall')
    draw_field(axes, refresh.field, blocked)
    draw_prototypes(axes, grid, refresh)
    draw_path(axes, report.demonstration, 'demonstration', DEMONSTRATED)
    if report.trials:
        last = report.trials[-1]
        draw_path(axes, last.path, f'trial {last.trial}')
    draw_movers(axes, report.movers)
    draw_goal(axes, refresh.field)
    draw_legend(figure)
    return figure


def history_figure(
    number: int, what: str, field: str, reports: Sequence[TaskReport],
) -> Figure:
    """Draw a number by trial for all tasks: figures 5 to 7."""
    figure = new_figure(6.4, 4.2)
    axes = figure.add_subplot()
    draw_history(axes, [(report.name, [getattr(trial, field) for trial in report.trials])
                        for report in reports], what, failed=[
        (trial.trial, getattr(trial, field)) for report in reports for trial in report.trials
        if trial.outcome != Outcome.GOAL])
    axes.set_title(f'Figure {number}  {what[0].upper()}{what[1:]} in each trial', loc='left',
                   fontsize=11, fontweight='bold')
    return figure
