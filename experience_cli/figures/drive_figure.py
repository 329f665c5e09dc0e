"""The picture of a drive alone: where the robot was, and what of that is not learnt."""

from collections.abc import Sequence

from matplotlib.figure import Figure
import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from experience_cli.figures import drawing


def drive_figure(
    title: str, path: npt.NDArray[np.float64], cut: npt.NDArray[np.bool_], grid: Grid | None,
    others: Sequence[tuple[str, npt.NDArray[np.float64]]] = (),
) -> Figure:
    """
    Draw a drive.

    Parameters
    ----------
    title : str
    path : ndarray, shape (n, 2), [m]
    cut : ndarray of bool, shape (n,)
        Which of it are in loops that are not learnt.
    grid : Grid or None
        The workspace, if there is one.
    others : sequence of (str, ndarray of shape (m, 2)), [m]
        Names and ways of other sources in the same frame.

    """
    figure = drawing.new_figure(8.0, 7.5)
    axes = figure.subplots()
    if grid is None:
        axes.set_aspect('equal', adjustable='datalim')
        axes.set_title(title, loc='left', fontsize=11, fontweight='bold')
        axes.set_xlabel('x [m]')
        axes.set_ylabel('y [m]')
    else:
        drawing.draw_frame(axes, grid, title)
    for name, way in others:
        axes.plot(way[:, 0], way[:, 1], linewidth=0.9, alpha=0.7, label=name, zorder=1)
    if not cut.all():
        drawing.draw_path(axes, np.where(cut[:, np.newaxis], np.nan, path), 'driven')
    drawing.draw_cut_out(axes, path, cut, path[:0])
    if len(path):
        axes.plot(*path[-1], marker='*', color=drawing.GOAL, markeredgecolor=drawing.WALL,
                  markersize=15, linestyle='none', label='end', zorder=4)
    drawing.draw_legend(figure)
    return figure
