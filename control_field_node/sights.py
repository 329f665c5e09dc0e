"""What the robot sees: the newest neighbourhood, where it lies, and whether it still counts."""

from control_field.grid import Grid
from control_field_node.intake import Intake
from control_field_node.localisation import Localisation
from control_field_node.seen import cached_seen, Seen
from msgs_bridge.neighbourhoods import Neighbourhood
from msgs_bridge.poses import Pose, problem_with_frame


class Sights:
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
        """Start without sight."""
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
        if not self._intake.is_late_sight(neighbourhood, self.newest):
            self.newest, self._cells = neighbourhood, cells
            self._intake.came(self._intake.sight, now, is_missed)

    def seen_from(self, pose: Pose | None, now: float, unknown_is_blocked: bool) -> Seen | None:
        """Return what is seen from a pose; None where nothing is, or what there is is too old."""
        sight, cells = self.newest, self._cells
        if sight is None or cells is None or pose is None or self._intake.sight.is_stale(now) or (
                abs(pose.stamp - sight.stamp) > self._intake.sight.timeout) or problem_with_frame(
                pose.frame_id, cells.frame_id, 'odom'):
            return None
        return self._seen(self._localisation.see(sight), cells, unknown_is_blocked)
