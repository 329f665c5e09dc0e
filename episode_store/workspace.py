"""Which workspace bags are of, and which of them is of another one."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
import shlex

from episode_store.episode import read_header
from episode_store.header import EpisodeHeader, WorkspaceError
from episode_store.rosbag2.errors import BagError, NothingToLearnError
from episode_store.task_folder import EpisodeFolder


@contextmanager
def odd_one_named(episodes: Sequence[EpisodeFolder]) -> Iterator[None]:
    """
    Let a refusal name the bag that is of another workspace than most, whichever was met first.

    The headers of all bags are read only then.

    Parameters
    ----------
    episodes : sequence of EpisodeFolder
        All that are learnt from.

    Raises
    ------
    BagError
        If they are not all of one workspace.

    """
    try:
        yield
    except WorkspaceError:
        check_workspaces(episodes)
        raise


def common_header(episodes: Sequence[EpisodeFolder]) -> EpisodeHeader | None:
    """
    Return what the last of some bags says of itself, all of which must be of one workspace.

    Raises
    ------
    BagError
        See `check_workspaces`.

    """
    headers = list(check_workspaces(episodes).values())
    return headers[-1] if headers else None


def check_workspaces(episodes: Sequence[EpisodeFolder]) -> dict[EpisodeFolder, EpisodeHeader]:
    """
    Refuse bags of several workspaces; that of most of them counts, of equally many the first.

    Returns
    -------
    dict of EpisodeFolder to EpisodeHeader
        Of the bags that hold anything.

    Raises
    ------
    BagError
        If one is of another grid or frame, naming both; or cannot be read, or is of another
        version.

    """
    headers = {}
    for episode in episodes:
        with suppress(NothingToLearnError):
            headers[episode] = read_header(episode.path)
    grids = {episode: header.grid for episode, header in headers.items()}
    if len(set(grids.values())) < 2:
        return headers
    common = Counter(grids.values()).most_common(1)[0][0]
    usual = [episode for episode, grid in grids.items() if grid == common]
    odd = next(episode for episode, grid in grids.items() if grid != common)
    more = f' and {len(usual) - 1} more' if len(usual) > 1 else ''
    raise BagError(
        f'{odd.path} was recorded on {grids[odd]}, {usual[0].path}{more} on {common}: what one '
        f'task has learnt is of one workspace; `experience forget {shlex.quote(str(odd.path))}` '
        f'takes the odd one out')
