"""The picture of two fields: each by itself, and where they differ."""

from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
import numpy.typing as npt

from control_field.local_grid import BLOCKED
from experience_cli.field_comparison import Comparison, Side, unit_vectors
from experience_cli.figures import drawing

#: Colours of the first and the second field where they differ.
FIRST: Final = '#b0651d'
SECOND: Final = '#1f5fa8'
_TINT: Final = '#fdf1dc'
_SAME: Final = '#c9d0db'


def comparison_figure(found: Comparison) -> Figure:
    """
    Draw two fields.

    Left and middle each with its basin, remembered walls and prototypes; right both on top of each
    other: grey where they agree, in two colours in the tinted cells where they differ.
    """
    figure = drawing.new_figure(19.0, 7.6)
    left, middle, right = figure.subplots(1, 3)
    for axes, side, colour in ((left, found.first, FIRST), (middle, found.second, SECOND)):
        _draw_side(axes, side, colour)
    _draw_difference(right, found)
    drawing.draw_legend(figure)
    figure.suptitle(_title(found), fontsize=12)
    return figure


def _title(found: Comparison) -> str:
    changed = found.prototypes()
    n, total = int(found.turned.sum()), int(found.shared.sum())
    return (f'{n} of {total} headings differ ({n / max(total, 1):.1%}); prototypes: '
            + ', '.join(f'{len(cells)} {name}' for name, cells in changed.items()))


def _draw_side(axes: Axes, side: Side, colour: str) -> None:
    field = side.field
    drawing.draw_frame(axes, field.grid, side.title)
    axes.set_title(side.title, loc='left', fontsize=11, fontweight='bold', color=colour)
    drawing.draw_basin(axes, field, side.parameters)
    drawing.draw_walls(axes, field)
    drawing.draw_field(axes, field)
    drawing.draw_sinks(axes, field.grid, side.certificate.sinks)
    xy = field.grid.world_from_cells(side.prototypes.cells)
    axes.scatter(xy[:, 0], xy[:, 1], s=46, facecolor='none', edgecolor=drawing.PROTOTYPE,
                 linewidth=1.4, label='prototype', zorder=1.5)
    drawing.draw_goal(axes, field)


def _draw_difference(axes: Axes, found: Comparison) -> None:
    grid = found.first.field.grid
    drawing.draw_frame(axes, grid, 'Where they differ')
    walls = (found.first.field.known == BLOCKED) & (found.second.field.known == BLOCKED)
    drawing.draw_cells(axes, grid, found.turned, _TINT, 'here they differ')
    drawing.draw_cells(axes, grid, walls, drawing.WALL)
    for side, colour in ((found.first, FIRST), (found.second, SECOND)):
        only = (side.field.known == BLOCKED) & ~walls
        drawing.draw_cells(axes, grid, only, colour + '80')
        if only.any():
            axes.plot([], [], marker='s', linestyle='none', markersize=9, color=colour + '80',
                      label=f'known to be blocked in {side.title} only')
    drawn = ~walls
    same = drawn & found.shared & ~found.turned
    _arrows(axes, found.first, same, _SAME, 'the same heading')
    _arrows(axes, found.first, drawn & found.turned, FIRST, f'heading of {found.first.title}')
    _arrows(axes, found.second, drawn & found.turned, SECOND, f'heading of {found.second.title}')
    drawing.draw_goal(axes, found.second.field)


def _arrows(
    axes: Axes, side: Side, cells: npt.NDArray[np.bool_], colour: str, label: str,
) -> None:
    """Draw the headings of some cells; on a large workspace only every few of them."""
    grid = side.field.grid
    step = max(1, max(grid.shape) // 60)
    rows, cols = np.indices(grid.shape)
    keep = cells & (side.headings >= 0) & (side.field.known != BLOCKED)
    keep &= (rows % step == 0) & (cols % step == 0)
    if not keep.any():
        return
    xy = grid.world_from_cells(np.stack([rows[keep], cols[keep]], axis=1))
    vectors = unit_vectors(side.headings)[keep]
    axes.quiver(xy[:, 0], xy[:, 1], vectors[:, 0], vectors[:, 1], color=colour, pivot='middle',
                angles='xy', scale_units='xy', scale=1.0 / (0.7 * step * grid.resolution),
                width=0.0042, headwidth=4.0, headlength=4.0, headaxislength=3.6, zorder=2)
    axes.plot([], [], color=colour, linewidth=2.5, label=label)
