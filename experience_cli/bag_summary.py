"""What there is to say of a bag: in one row, and of what it lacks."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from datetime import datetime
import shlex
import sys
from typing import Any

from control_field.grid import Grid
from control_field.records import Demonstration, Outcome, Trial
from episode_store.cut import has_its_end, missing_of_bag
from episode_store.episode import Episode, read_episode
from episode_store.gaps import gaps_in
from episode_store.label import read_label
from episode_store.lock import is_in_use
from episode_store.recording import Recording
from episode_store.repair import needs_repair
from episode_store.rosbag2.errors import BagError, error_line, NothingToLearnError
from episode_store.task_folder import EpisodeFolder


@dataclass(frozen=True)
class Summary:
    """
    A bag in one row.

    Parameters
    ----------
    bag, kind, path : str
        Such as ``task1/0003``, ``trial``, and where its folder is.
    state : str
        ``kept`` (it is learnt from), ``incomplete`` (the same, and messages are missing in the
        middle), ``not kept``, ``aborted``, ``forgotten``, ``recording`` (by
        a learner that runs), ``cut`` (its recording was not closed) or ``unreadable``.
    begun : float or None
        Time of day, [s] since 1970; None in simulated time.
    duration : float or None
        Of the drive, [s].
    messages : int
    cells : int or None
        Of a demonstration.
    steps : int or None
        Of a trial.
    outcome : str
        How a trial ended, a person's judgement aside; empty for a demonstration.
    label : str
        ``success``, ``failure`` or empty.
    size : int
        Of the recording, [bytes].
    note : str
        What else there is to say.

    """

    bag: str
    kind: str
    path: str
    state: str
    begun: float | None = None
    duration: float | None = None
    messages: int = 0
    cells: int | None = None
    steps: int | None = None
    outcome: str = ''
    label: str = ''
    size: int = 0
    note: str = ''

    def to_json(self) -> dict[str, Any]:
        """Return it by name."""
        return asdict(self)


def summary_of(folder: EpisodeFolder) -> Summary:
    """Sum up a bag; one that cannot be read says why in its note."""
    about: dict[str, Any] = {
        'bag': folder.name, 'kind': str(folder.kind), 'path': str(folder.path)}
    try:
        about['size'] = folder.bag.stat().st_size if folder.bag.exists() else 0
        is_cut = needs_repair(folder.path)
        recording = Recording(folder)
        about |= {'begun': recording.begun, 'duration': round(recording.duration, 3),
                  'messages': sum(recording.counts.values()),
                  'label': str(read_label(folder.path) or '')}
        about |= _learnt(folder)
        about |= _missing(folder, about)
    except NothingToLearnError as error:
        about |= {'state': 'cut' if is_cut else 'not kept', 'note': str(error)}
        is_cut = False
    except (BagError, OSError) as error:
        note = error_line('read', folder.path, error) if isinstance(error, OSError) else error
        return Summary(**(about | {'state': 'unreadable', 'note': str(note)}))
    if is_cut and is_in_use(folder.path.parent):
        about |= {'state': 'recording', 'note': 'a learner records it just now'}
    elif is_cut:
        about |= {'state': 'cut', 'note': f'mend it with `experience repair {folder.path}`'}
    if folder.is_forgotten:
        about['state'] = 'forgotten'
    return Summary(**about)


def _missing(folder: EpisodeFolder, about: dict[str, Any]) -> dict[str, Any]:
    """Return what changes where messages are missing in the middle of a bag."""
    gaps = gaps_in(folder.path)
    if not gaps:
        return {}
    note = '; '.join(filter(None, [str(gaps), about['note']]))
    return {'note': note, 'state': 'incomplete' if about['state'] == 'kept' else about['state']}


def _learnt(folder: EpisodeFolder) -> dict[str, Any]:
    """Return what the learner makes of a bag."""
    try:
        episode = read_episode(folder.path)
    except NothingToLearnError as error:
        return {'state': 'not kept', 'note': str(error)}
    record = episode.record
    said = {'state': 'kept', 'label': str(episode.label), 'note': '; '.join(
        [*(episode.report.sentences() if episode.report else []), *episode.notes])}
    if isinstance(record, Demonstration):
        return said | {'cells': len(record.cells)}
    return said | _trial(episode, record)


def _trial(episode: Episode, record: Trial) -> dict[str, Any]:
    ended = episode.status.outcome if episode.status else None
    values: dict[str, Any] = {'steps': record.n_steps, 'outcome': str(ended or Outcome.ABORTED)}
    if record.outcome is Outcome.ABORTED:
        why = episode.status.reason if episode.status else 'it was broken off'
        state = 'not kept' if episode.doubt else 'aborted'
        values |= {'state': state, 'note': episode.doubt or why}
    return values


def time_text(begun: float | None) -> str:
    """Return date and time of day where the robot lives, or that time is simulated."""
    if begun is None:
        return 'simulated'
    return datetime.fromtimestamp(begun).astimezone().strftime('%Y-%m-%d %H:%M')


def grid_text(grid: Grid) -> str:
    """Return a workspace in words."""
    return f'{grid.size} from ({grid.origin_x:g}, {grid.origin_y:g}) in {grid.frame_id}'


def size_text(size: int) -> str:
    """Return a size in kB or MB."""
    return f'{size / 1e6:.1f} MB' if size >= 1e6 else f'{size / 1e3:.0f} kB'


def say_cuts(command: str, episodes: Iterable[EpisodeFolder]) -> None:
    """
    Say of each bag that was not closed what is missing, in a line on stderr; nothing is changed.

    Raises
    ------
    BagError
        If one cannot be read.

    """
    for episode in episodes:
        if not has_its_end(episode.path):
            say_cut(command, episode)


def say_cut(command: str, episode: EpisodeFolder) -> None:
    """Say what is missing of one bag, see `say_cuts`; here its index is looked at, too."""
    missing = missing_of_bag(episode.path)
    if not missing:
        return
    advice = f'`experience repair {shlex.quote(str(episode.path))}` mends it'
    if is_in_use(episode.task_path):
        advice = 'it is being recorded or changed just now'
    print(f'experience {command}: {episode.path} was not closed: {missing}; {advice}',
          file=sys.stderr)


def say_gaps(command: str, episode: EpisodeFolder) -> bool:
    """Say, in a line on stderr, what is missing in the middle of a bag; tell whether anything."""
    try:
        gaps = gaps_in(episode.path)
    except BagError:
        return False  # what cannot be read at all is said where it is learnt from
    if gaps:
        print(f'experience {command}: {episode.name}: {gaps}', file=sys.stderr)
    return bool(gaps)
