"""What has to hold of the workspaces of the bags of one task."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
import shlex

from control_field.grid import Grid
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError, WorkspaceError
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder


@contextmanager
def odd_one_named(folders: Sequence[EpisodeFolder]) -> Iterator[None]:
    """
    Let a refusal name the bag that is of another workspace than most, whichever was met first.

    The headers of all bags are read only then.

    Parameters
    ----------
    folders : sequence of EpisodeFolder
        All that are learnt from.

    Raises
    ------
    BagError
        If they are not all of one workspace.

    """
    try:
        yield
    except WorkspaceError:
        check_workspaces(folders)
        raise


def check_workspaces(folders: Sequence[EpisodeFolder]) -> list[EpisodeHeader]:
    """
    Refuse bags of several workspaces; that of most of them counts, of equally many the first.

    If the workspace of the last one fits itself, they may be of any extent, but on the same cells.

    Returns
    -------
    list of EpisodeHeader
        Of the bags that hold anything.

    Raises
    ------
    BagError
        If one is of another grid or frame, or of other cells, naming both; or cannot be read, or
        is of another version.

    """
    headers = {}
    for folder in folders:
        with suppress(NothingToLearnError):
            headers[folder] = Episode(folder).header
    found = list(headers.values())
    fitted = bool(found) and found[-1].fitted

    def is_of(grid: Grid, other: Grid) -> bool:
        return grid.offset_to(other) is not None if fitted else grid == other

    # The first of those that each is of one workspace with.
    first = [next(other.grid for other in found if is_of(header.grid, other.grid))
             for header in found]
    if len(set(first)) > 1:
        common = Counter(first).most_common(1)[0][0]
        usual = [folder for folder, grid in zip(headers, first, strict=True) if grid == common]
        odd = next(folder for folder, grid in zip(headers, first, strict=True) if grid != common)
        raise BagError(_two_workspaces(odd, headers[odd].grid, usual, common, fitted))
    return found


def _two_workspaces(
    odd: EpisodeFolder, grid: Grid, usual: Sequence[EpisodeFolder], common: Grid, fitted: bool,
) -> str:
    """Say which bag is of another workspace than the usual ones, and what to do."""
    more = f' and {len(usual) - 1} more' if len(usual) > 1 else ''
    what = 'the same cells' if fitted else 'one workspace'
    fits = '' if grid.offset_to(common) is None else (
        '; or let the workspace fit itself: leave rows, cols, origin_x and origin_y out')
    return (f'{odd.path} was recorded on {grid}, {usual[0].path}{more} on {common}: what one task '
            f'has learnt is of {what}; `experience forget {shlex.quote(str(odd.path))}` takes the '
            f'odd one out{fits}')
