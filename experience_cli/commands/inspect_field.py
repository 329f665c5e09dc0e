"""`experience inspect`: a picture of what was learnt."""

import argparse
from functools import partial
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from control_field.drives.breaks import place_text
from control_field.drives.plausibility import DriveLimits, whole_drive
from episode_store.relearn import LearntBag, Relearner
from episode_store.relearning import fold
from episode_store.task_folder import EpisodeFolder
from experience_cli.bag_argument import episodes_from_paths, episodes_up_to, named_path
from experience_cli.bag_summary import say_cuts, say_gaps
from experience_cli.demo.report import driven_poses
from experience_cli.errors import UserError
from experience_cli.external_bags import borrowed, is_borrowed
from experience_cli.figures import drawing
from experience_cli.output import write_output


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    arguments.bag = named_path(arguments.bag)
    if is_borrowed(arguments, arguments.bag):
        path = arguments.bag.resolve()
        with borrowed(arguments, arguments.bag) as episode:
            _inspect(arguments, episode, path.with_name(f'{path.name}.png'))
    else:
        last = episodes_from_paths([arguments.bag])[-1]
        _inspect(arguments, last, last.path.parent / f'{last.path.name}.png')
    return 0


def _inspect(arguments: argparse.Namespace, last: EpisodeFolder, beside: Path) -> None:
    """Draw what the bags up to one have taught, and say it."""
    episodes = episodes_up_to(last)
    relearner, each = fold(episodes)
    say_cuts('inspect', episodes)
    for episode in episodes:
        say_gaps('inspect', episode)
    if relearner is None or relearner.refresh is None:
        raise UserError(f'{arguments.bag}: nothing was learnt up to there')
    learnt_bag = [learnt_bag for learnt_bag in each if learnt_bag.read is not None][-1]
    out = arguments.out or beside
    write_output(out, partial(inspection_figure(learnt_bag, relearner).savefig, format='png'))
    certificate = relearner.refresh.certificate
    print(f'{last.name}: {certificate.sentence()}')
    places = ', '.join(map(place_text, relearner.teach_here(3)))
    if places:
        print(f'One more drive to the goal would help most from (x, y) = {places} m.')
    print(f'in numbers: {certificate.numbers()}')
    print(out)


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
    refresh, grid = relearner.refresh, relearner.grid
    assert refresh is not None
    figure = drawing.new_figure(13.0, 8.0)
    left, right = figure.subplots(1, 2)
    newest = learnt_bag.episode
    drawing.draw_frame(left, grid, f'Field after {newest.name} ({newest.kind})')
    drawing.draw_frame(right, grid, 'Remembered map and prototypes')
    drawing.draw_basin(left, refresh.field, relearner.parameters)
    drawing.draw_cells(left, grid, refresh.field.known == 100, drawing.WALL, 'known to be blocked')
    drawing.draw_field(left, refresh.field)
    drawing.draw_sinks(left, grid, refresh.certificate.sinks)
    drawing.draw_known(right, refresh.field)
    drawing.draw_prototypes(right, grid, refresh)
    for axes in (left, right):
        _draw_drive(axes, learnt_bag)
        drawing.draw_goal(axes, refresh.field)
    drawing.draw_legend(figure)
    certificate = refresh.certificate
    figure.suptitle(f'{certificate.sentence()}\n{certificate.numbers()}', fontsize=10.5)
    return figure


def _draw_drive(axes: Axes, learnt_bag: LearntBag) -> None:
    """Draw where the robot drove, and in a style of its own what of that is not learnt."""
    poses, read = driven_poses(learnt_bag.episode), learnt_bag.read
    stamps, path = poses.stamps, poses.xy
    label = f'driven in {learnt_bag.episode.name}'
    if read is None or read.report is None:
        drawing.draw_path(axes, path, label)
        return
    header = read.header
    limits = DriveLimits(header.grid.resolution, header.speed_max)
    kept = whole_drive(stamps, path, limits, poses.motion).kept
    left_out = np.delete(path, kept, axis=0)
    stamps, path = stamps[kept], path[kept]
    loops = np.zeros(len(stamps), dtype=np.bool_)
    for loop in read.report.loops:
        loops |= (stamps >= loop.first) & (stamps <= loop.last)
    # The last pose of a loop is the first of what goes on from there, so that no gap is drawn.
    goes_on = loops & ~np.append(loops[1:], False)
    drawing.draw_path(axes, np.where((loops & ~goes_on)[:, np.newaxis], np.nan, path), label)
    drawing.draw_cut_out(axes, path, loops, left_out)
