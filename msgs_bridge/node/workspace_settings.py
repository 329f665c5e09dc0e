"""
The workspace among the parameters of a node, as learner and local grid have it.

Without rows and columns there is none to set: the workspace fits itself.
"""

from typing import Protocol

from control_field.grid import cell_side, Grid

#: Least side of a cell that is set, [m]; 0 is none.
_LEAST_SIDE = 0.01


class WorkspaceSettings(Protocol):
    """The settings of a node that has a workspace; see their declarations."""

    @property
    def frame_id(self) -> str:
        """Return the frame."""

    @property
    def rows(self) -> int:
        """Return the number of rows; 0: the workspace fits itself."""

    @property
    def cols(self) -> int:
        """Return the number of columns, likewise."""

    @property
    def resolution(self) -> float:
        """Return the side of a cell, [m]; 0: by the robot's size."""

    @property
    def origin_x(self) -> float:
        """Return x of the lower left corner, [m]."""

    @property
    def origin_y(self) -> float:
        """Return y of the lower left corner, [m]."""

    @property
    def robot_radius(self) -> float:
        """Return the radius of the body, [m]."""


def check_workspace(settings: WorkspaceSettings) -> None:
    """
    Refuse what is half a workspace.

    Raises
    ------
    ValueError
        One line that says what to do.

    """
    rows, cols = settings.rows, settings.cols
    if bool(rows) != bool(cols):
        given, missing = ('rows', 'cols') if rows else ('cols', 'rows')
        raise ValueError(f'{given} is {rows or cols} and {missing} is 0: set both, or leave both '
                         f'out and the workspace fits itself')
    if not rows and (settings.origin_x or settings.origin_y):
        raise ValueError(
            f'origin_x, origin_y are ({settings.origin_x:g}, {settings.origin_y:g}) and rows, '
            f'cols are 0: a workspace that fits itself has no corner to set; leave the origin '
            f'out, or set rows and cols, too')
    if 0.0 < settings.resolution < _LEAST_SIDE:
        raise ValueError(f'resolution is {settings.resolution:g} m, must be at least '
                         f'{_LEAST_SIDE:g}, or 0 for cells by robot_radius')
    if not settings.resolution and not settings.robot_radius:
        raise ValueError('resolution and robot_radius are 0: set one of them, or nobody knows '
                         'how large cells are')


def side_of_cells(settings: WorkspaceSettings) -> float:
    """Return the side of a cell, [m]: what is set, else what holds the robot."""
    return float(settings.resolution) or cell_side(settings.robot_radius)


def set_workspace(settings: WorkspaceSettings) -> Grid | None:
    """Return the workspace that is set; None for one that fits itself."""
    if not settings.rows:
        return None
    return Grid(settings.rows, settings.cols, side_of_cells(settings), float(settings.origin_x),
                float(settings.origin_y), settings.frame_id)
