"""The picture of what was learnt: the field, the remembered map, and the newest drive."""

from textwrap import wrap
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from control_field.drives.plausibility import DriveLimits, whole_drive
from episode_store.episode import Episode
from episode_store.relearn import LearntBag, Relearner
from experience_cli.demo.report import driven_poses
from experience_cli.figures import drawing

#: A workspace so many times as wide as it is high is drawn in two rows.
_LONG: Final = 2
#: So many letters stand in a line above both.
_LETTERS: Final = 130


def inspection_figure(learnt_bag: LearntBag, relearner: Relearner) -> Figure:
    """
    Draw the field with basin, sinks and prototypes, the remembered map, and the way driven.

    Parameters
    ----------
    learnt_bag : LearntBag
        The newest one.
    relearner : Relearner
        That has learnt something.

    """
    refresh = relearner.refresh
    assert refresh is not None
    grid = refresh.field.grid
    figure = drawing.new_figure(13.0, 8.0)
    # A long way along x has room below another one only.
    is_long = grid.n_cols > _LONG * grid.n_rows
    left, right = figure.subplots(*((2, 1) if is_long else (1, 2)))
    newest = learnt_bag.folder
    drawing.draw_frame(left, grid, f'Field after {newest.name} ({newest.kind})')
    drawing.draw_frame(right, grid, 'Remembered map and prototypes')
    drawing.draw_basin(left, refresh.field, relearner.parameters)
    drawing.draw_walls(left, refresh.field)
    drawing.draw_field(left, refresh.field)
    drawing.draw_sinks(left, grid, refresh.certificate.sinks)
    drawing.draw_known(right, refresh.field)
    drawing.draw_prototypes(right, grid, refresh)
    for axes in (left, right):
        _draw_drive(axes, learnt_bag)
        drawing.draw_goal(axes, refresh.field)
    drawing.draw_legend(figure)
    certificate = refresh.certificate
    numbers = '\n'.join(wrap(certificate.numbers(), _LETTERS))
    figure.suptitle(f'{certificate.sentence()}\n{numbers}', fontsize=10.5)
    return figure


def _draw_drive(axes: Axes, learnt_bag: LearntBag) -> None:
    """Draw where the robot drove, and in a style of its own what of that is not learnt."""
    episode, content = Episode(learnt_bag.folder), learnt_bag.content
    poses, label = driven_poses(episode), f'driven in {learnt_bag.folder.name}'
    stamps, path = poses.stamps, poses.xy
    if content is None or content.report is None:
        drawing.draw_path(axes, path, label)
        return
    limits = DriveLimits(episode.header.grid.resolution, episode.header.speed_max)
    kept = whole_drive(stamps, path, limits, poses.motion).kept
    left_out = np.delete(path, kept, axis=0)
    stamps, path = stamps[kept], path[kept]
    loops = np.zeros(len(stamps), dtype=np.bool_)
    for loop in content.report.loops:
        loops |= (stamps >= loop.first) & (stamps <= loop.last)
    # The last pose of a loop is the first of what goes on from there, so that no gap is drawn.
    goes_on = loops & ~np.append(loops[1:], False)
    drawing.draw_path(axes, np.where((loops & ~goes_on)[:, np.newaxis], np.nan, path), label)
    drawing.draw_cut_out(axes, path, loops, left_out)
