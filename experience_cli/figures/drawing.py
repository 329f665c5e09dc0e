"""Drawing fields, maps and paths with matplotlib; no display is needed."""

from collections.abc import Sequence
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator
import numpy as np
import numpy.typing as npt

from control_field.grid import Grid
from control_field.headings import headings_from_vectors
from control_field.kernels import compiled
from control_field.learning.learner import Refresh
from control_field.local_grid import BLOCKED
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.policy import is_doubted, rules_of
from world_maps.mover import Mover

#: Colours that are told apart by most people, also in grey.
WALL: Final = '#3b4252'
ARROW: Final = '#4c6a92'
DEMONSTRATED: Final = '#d08770'
PROTOTYPE: Final = '#2a9d8f'
PATH: Final = '#d1495b'
GOAL: Final = '#e9b44c'
SINK: Final = '#8b1e3f'
CUT: Final = '#5e6472'
MOVER: Final = '#7b4b94'
DOUBTED: Final = '#a7adba'
BASIN: Final = '#e3f1e4'
_UNSEEN: Final = '#eceff4'
_FAINT: Final = '#d8dee9'


def new_figure(width: float = 7.0, height: float = 7.0) -> Figure:
    """Return an empty figure, size in inches."""
    return Figure(figsize=(width, height), dpi=130, layout='constrained')


def draw_frame(axes: Axes, grid: Grid, title: str) -> None:
    """Draw cells and axes."""
    high_x = grid.origin_x + grid.n_cols * grid.resolution
    high_y = grid.origin_y + grid.n_rows * grid.resolution
    axes.set_xlim(grid.origin_x, high_x)
    axes.set_ylim(grid.origin_y, high_y)
    axes.set_aspect('equal')
    if max(grid.shape) <= 60:
        axes.set_xticks(np.linspace(grid.origin_x, high_x, grid.n_cols + 1), minor=True)
        axes.set_yticks(np.linspace(grid.origin_y, high_y, grid.n_rows + 1), minor=True)
        axes.grid(which='minor', color=_FAINT, linewidth=0.5)
        axes.tick_params(which='minor', length=0)
    axes.set_xlabel('x [m]')
    axes.set_ylabel('y [m]')
    axes.set_title(title, loc='left', fontsize=11, fontweight='bold')
    axes.set_axisbelow(True)


def draw_cells(
    axes: Axes, grid: Grid, mask: npt.NDArray[np.bool_], colour: str, label: str = '',
) -> None:
    """Fill the cells of a mask; if there are any and there is a label, the legend has it."""
    if label and mask.any():
        axes.plot([], [], marker='s', markersize=9, color=colour, markeredgecolor=WALL,
                  markeredgewidth=0.4, linestyle='none', label=label)
    clear = to_rgba(colour, 0.0)
    axes.imshow(mask, origin='lower', extent=_extent(grid), interpolation='nearest',
                cmap=ListedColormap([clear, to_rgba(colour)]), vmin=0, vmax=1, zorder=0.5)


def draw_field(
    axes: Axes, field: ControlField, blocked: npt.NDArray[np.bool_] | None = None,
) -> None:
    """Draw the heading of every cell but blocked ones, faint where the coherence is small."""
    grid = field.grid
    rows, cols = np.indices(grid.shape)
    keep = ((field.vx != 0.0) | (field.vy != 0.0))
    keep &= (field.known != BLOCKED) if blocked is None else ~blocked
    step = max(1, max(grid.shape) // 60)
    keep &= (rows % step == 0) & (cols % step == 0)
    xy = grid.world_from_cells(np.stack([rows[keep], cols[keep]], axis=1))
    colours = np.tile(to_rgba(ARROW), (len(xy), 1))
    colours[:, 3] = 0.35 + 0.65 * np.clip(field.coherence[keep], 0.0, 1.0)
    axes.quiver(xy[:, 0], xy[:, 1], field.vx[keep], field.vy[keep], color=colours, pivot='middle',
                angles='xy', scale_units='xy', scale=1.0 / (0.62 * step * grid.resolution),
                width=0.0035, headwidth=4.5, headlength=4.5, headaxislength=4.0, zorder=2)
    axes.plot([], [], marker=r'$\rightarrow$', markersize=13, color=ARROW, linestyle='none',
              label='heading (faint: prototypes disagree)')


def draw_prototypes(axes: Axes, grid: Grid, refresh: Refresh) -> None:
    """Draw the centres, the demonstrated ones in another colour."""
    prototypes = refresh.prototypes
    xy = grid.world_from_cells(prototypes.cells)
    for mask, colour, label in (
            (prototypes.demonstrated, DEMONSTRATED, 'prototype, demonstrated'),
            (~prototypes.demonstrated, PROTOTYPE, 'prototype, learnt')):
        if mask.any():
            axes.scatter(xy[mask, 0], xy[mask, 1], s=46, facecolor=to_rgba(colour, 0.55),
                         edgecolor=colour, linewidth=0.8, label=label, zorder=1.5)


def draw_path(axes: Axes, path: npt.NDArray[np.float64], label: str, colour: str = PATH) -> None:
    """Draw where the robot drove, with a dot where it started."""
    if len(path):
        axes.plot(path[:, 0], path[:, 1], color=colour, linewidth=2.2, label=label, zorder=3,
                  solid_capstyle='round')
        driven = path[np.isfinite(path).all(axis=1)]
        axes.plot(*driven[0], marker='o', color=WALL, markersize=6, zorder=3, linestyle='none',
                  label='start')


def draw_cut_out(
    axes: Axes, path: npt.NDArray[np.float64], loops: npt.NDArray[np.bool_],
    left_out: npt.NDArray[np.float64],
) -> None:
    """
    Draw what of a drive is not learnt.

    Parameters
    ----------
    axes : Axes
    path : ndarray, shape (n, 2), [m]
        Where the robot drove.
    loops : ndarray of bool, shape (n,)
        Which of that only led back to where it had been.
    left_out : ndarray, shape (m, 2), [m]
        Poses that are none of this drive.

    """
    if loops.any():
        pieces = np.where(loops[:, np.newaxis], path, np.nan)
        axes.plot(pieces[:, 0], pieces[:, 1], color=CUT, linewidth=2.0, linestyle=(0, (1, 1.2)),
                  label='a loop, cut out: not learnt', zorder=2.9)
    if len(left_out):
        axes.plot(left_out[:, 0], left_out[:, 1], marker='+', color=CUT, linestyle='none',
                  markersize=9, markeredgewidth=1.6, label='pose far off, left out', zorder=3)


def draw_movers(axes: Axes, movers: Sequence[Mover]) -> None:
    """Draw the ways of those who move, with a disc where each begins."""
    for number, mover in enumerate(mover for mover in movers if mover.waypoints):
        way = [point[:2] for point in mover.waypoints]
        if mover.mode == 'loop':
            way.append(way[0])
        axes.plot(*zip(*way, strict=True), color=MOVER, linestyle=':', linewidth=1.6, zorder=3,
                  label='' if number else 'who moves')
        axes.add_patch(Circle(way[0], mover.radius, color=MOVER, alpha=0.5, zorder=3))


def draw_goal(axes: Axes, field: ControlField) -> None:
    """Draw the goal's cell with its letter, as the paper does."""
    x, y = field.grid.world_from_cell(*field.goal)
    axes.plot(x, y, marker='s', markersize=13, color=GOAL, markeredgecolor=WALL, zorder=3.5,
              linestyle='none', label='goal')
    axes.text(x, y, 'G', ha='center', va='center', fontsize=9, fontweight='bold', zorder=4)


def draw_sinks(axes: Axes, grid: Grid, sinks: npt.NDArray[np.integer[Any]]) -> None:
    """Draw the cells where flows end that should not."""
    if len(sinks):
        xy = grid.world_from_cells(sinks)
        axes.plot(xy[:, 0], xy[:, 1], marker='x', color=SINK, linestyle='none', markersize=8,
                  markeredgewidth=2.0, label='sink: a flow ends here', zorder=3)


def draw_known(axes: Axes, field: ControlField) -> None:
    """Draw the remembered map: blocked, in doubt, free, never seen."""
    draw_cells(axes, field.grid, field.known < 0, _UNSEEN, 'never seen')
    draw_walls(axes, field)


def draw_walls(axes: Axes, field: ControlField) -> None:
    """Draw the walls of the remembered map; those in doubt lighter, with a question mark."""
    draw_cells(axes, field.grid, field.known == BLOCKED, WALL, 'known to be blocked')
    in_doubt = is_doubted(field.known)
    draw_cells(axes, field.grid, in_doubt, DOUBTED, 'was blocked when last seen, in doubt now')
    if in_doubt.any() and max(field.grid.shape) <= 60:
        xy = field.grid.world_from_cells(np.argwhere(in_doubt))
        axes.plot(xy[:, 0], xy[:, 1], marker='$?$', color=WALL, linestyle='none', markersize=6,
                  markeredgewidth=0.3, zorder=2.5)


def draw_basin(axes: Axes, field: ControlField, parameters: Parameters) -> None:
    """Tint the cells whose flow reaches the goal on the remembered map."""
    state = compiled.flow_basin(
        field.known, headings_from_vectors(field.vx, field.vy), *field.goal, rules_of(parameters))
    draw_cells(axes, field.grid, state == 1, BASIN, 'leads to the goal')


def draw_legend(figure: Figure) -> None:
    """Put one legend for all axes below them."""
    entries = {label: handle for axes in figure.axes
               for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    # As wide as the widest word needs: a long one takes the place of two.
    letters = max(map(len, entries), default=1)
    n_columns = max(1, int(figure.get_figwidth() * 13.0 / (letters + 6)))
    figure.legend(list(entries.values()), list(entries), loc='outside lower center',
                  ncol=n_columns, frameon=False, fontsize=8.5, handletextpad=0.5,
                  columnspacing=1.4)


def draw_history(
    axes: Axes, series: Sequence[tuple[str, Sequence[float]]], what: str, first: int = 1,
    failed: Sequence[tuple[int, float]] = (),
) -> None:
    """
    Draw a number by trial, the first task broken and the second solid, as the paper does.

    Parameters
    ----------
    axes : Axes
    series : sequence of (str, sequence of float)
        Tasks, each with its numbers.
    what : str
        Stands beside the axis.
    first : int
        The trial that the first number belongs to.
    failed : sequence of (int, float)
        Trials that did not reach the goal, each with its number.

    """
    styles = (('--', 'o', PATH), ('-', 's', ARROW), ('-.', '^', PROTOTYPE), (':', 'v', GOAL))
    for index, (name, values) in enumerate(series):
        line, marker, colour = styles[index % len(styles)]
        # Where two lines are one, the broken one lies on top and both markers are seen.
        axes.plot(range(first, len(values) + first), values, linestyle=line, marker=marker,
                  color=colour, linewidth=2.0, markersize=10.0 - 4.0 * (index % 2), label=name,
                  markerfacecolor='none' if index % 2 == 0 else colour,
                  zorder=3.0 - 0.1 * index)
    if failed:
        axes.plot(*zip(*failed, strict=True), linestyle='none', marker='X', markersize=11.0,
                  color=SINK, markeredgecolor='white', label='the goal was not reached',
                  zorder=3.5)
    axes.set_xlabel('trial')
    axes.set_ylabel(what)
    axes.set_ylim(bottom=0, top=1.15 * max([1.0, *(max(v) for _, v in series if len(v))]))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axes.grid(color=_FAINT, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[['top', 'right']].set_visible(False)
    axes.legend(frameon=False)


def _extent(grid: Grid) -> tuple[float, float, float, float]:
    return (grid.origin_x, grid.origin_x + grid.n_cols * grid.resolution,
            grid.origin_y, grid.origin_y + grid.n_rows * grid.resolution)
