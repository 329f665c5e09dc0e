"""What the robot sees: the newest neighbourhood, where it lies, and whether it still counts."""

from control_field.grid import Grid
from control_field_node.intake import Intake
from control_field_node.localisation import Localisation
from control_field_node.seen import cached_seen, Seen
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose, problem_with_frame


class LocalGrids:
    """
    Keeps the newest neighbourhood.

    Parameters
    ----------
    intake : Intake
        What is late, and what is stale.
    localisation : Localisation
        Where a neighbourhood belongs if odometry is not taken at its word.

    Attributes
    ----------
    newest : Neighbourhood or None

    """

    def __init__(self, intake: Intake, localisation: Localisation) -> None:
        """Start without local grid."""
        self.newest: Neighbourhood | None = None
        self._cells: Grid | None = None
        self._intake, self._localisation = intake, localisation
        self._seen = cached_seen()

    def take_workspace(self, grid: Grid) -> None:
        """Forget what lies on the cells of another workspace: it is to be read anew."""
        if self._cells != grid:
            self.newest = self._cells = None

    def saw(
        self, neighbourhood: Neighbourhood, cells: Grid | None, now: float, is_missed: bool,
    ) -> None:
        """
        Take in a neighbourhood; a late one is passed over.

        Parameters
        ----------
        neighbourhood : Neighbourhood
        cells : Grid or None
            The workspace that its row and column count in.
        now : float, [s]
            On the steady clock.
        is_missed : bool
            Whether the robot stands for something that is missing.

        """
        if self._intake.is_late_local_grid(neighbourhood, self.newest):
            self._intake.local_grid.pass_over(
                now, f'its stamps go back (last {neighbourhood.stamp:.2f} s)')
            return
        self.newest, self._cells = neighbourhood, cells
        self._intake.came(self._intake.local_grid, now, is_missed)

    def seen_from(self, pose: Pose | None, now: float, unknown_is_blocked: bool) -> Seen | None:
        """Return what is seen from a pose; None where nothing is, or what there is is too old."""
        local_grid, cells = self.newest, self._cells
        if local_grid is None or cells is None or pose is None or self.problem(pose, now):
            return None
        return self._seen(self._localisation.see(local_grid), cells, unknown_is_blocked)

    def problem(self, pose: Pose | None, now: float) -> str:
        """Say why nothing is seen from a pose; empty if something is."""
        local_grid, cells, fresh = self.newest, self._cells, self._intake.local_grid
        if pose is None or self._intake.odometry.is_stale(now):
            return self._intake.odometry.absence(now, 'odometry')
        if local_grid is None or cells is None or fresh.is_stale(now):
            return fresh.absence(now, 'neighbourhood')
        if abs(apart := pose.stamp - local_grid.stamp) > fresh.timeout:
            return (f'the stamp of the neighbourhood is {abs(apart):.2f} s '
                    f'{"behind" if apart > 0.0 else "ahead of"} that of odometry, must be at most '
                    f'neighbourhood_timeout ({fresh.timeout:g} s)')
        return problem_with_frame(pose.frame_id, cells.frame_id, 'odom')
