"""Episodes: what a bag teaches. The field is a pure function of these, in order."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
import os
from pathlib import Path

from control_field.drives.demonstration import DemonstrationReport
from control_field.drives.plausibility import SPEED_MAX
from control_field.drives.workspace import OutsideWorkspaceError
from control_field.grid import Grid
from control_field.records import Demonstration, Outcome, Trial
from control_field.words import counted
from episode_store.drives import Drive, read_drive, remedy_for_external, remedy_for_own
from episode_store.header import EpisodeHeader
from episode_store.label import read_label
from episode_store.rosbag2.any_reader import InLogOrder, notes_on, open_bag
from episode_store.rosbag2.bag_files import storage_files
from episode_store.rosbag2.errors import BagError, mcap_path, NothingToLearnError
from episode_store.rosbag2.reader import Bag, BagReader, RawMessages
from episode_store.rosbag2.topic_tables import decision_table, statuses
from episode_store.rosbag2.writer import HEADER_NAME
from episode_store.task_folder import episode_from_path, EpisodeFolder, EpisodeKind, TaskFolder
from episode_store.trials import doubt_about, judged, own_trial
from msgs_bridge.messages.memory_identity import difference
from msgs_bridge.messages.trial_status import Label, State, TrialStatus


@dataclass(frozen=True, eq=False)
class Episode:
    """
    What a bag teaches.

    Parameters
    ----------
    folder : EpisodeFolder
        The bag.
    header : EpisodeHeader
        What it says of itself.
    record : Demonstration or Trial
        What the learner is given.
    report : DemonstrationReport or None
        What of a demonstration was dropped.
    status : TrialStatus or None
        How it ended; None for a trial that was broken off.
    notes : tuple of str
        Sentences on what was passed over.
    label : Label
        What a person said of it, under way or afterwards; ``record`` heeds it.
    doubt : str
        Why a trial and its odometry do not belong together; it is as good as aborted then.

    """

    folder: EpisodeFolder
    header: EpisodeHeader
    record: Demonstration | Trial
    report: DemonstrationReport | None = None
    status: TrialStatus | None = None
    notes: tuple[str, ...] = ()
    label: Label = Label.NONE
    doubt: str = ''


class OutsideDriveError(BagError):
    """
    The drive of a bag leaves the workspace.

    Parameters
    ----------
    message : str
    fitting : Grid or None
        A workspace that holds the whole drive; None if none does.

    """

    def __init__(self, message: str, fitting: Grid | None) -> None:
        """Keep both."""
        super().__init__(message)
        self.fitting = fitting


def read_header(folder: Path | str) -> EpisodeHeader:
    """
    Read what a bag of ours says of itself.

    Raises
    ------
    NothingToLearnError
        If its recorder was stopped before it wrote anything.
    BagError
        If it cannot be read, is of another version, or none of ours.

    """
    return _header(_reader(mcap_path(Path(folder))))


def read_episode(folder: Path | str, grid: Grid | None = None) -> Episode:
    """
    Read a bag of ours.

    Parameters
    ----------
    folder : Path
        The bag's folder; it may be damaged, what is readable of it counts.
    grid : Grid, optional
        The workspace it must have been recorded in.

    Raises
    ------
    NothingToLearnError
        If there is nothing in it to learn from.
    BagError
        If it cannot be read, or is of another grid, frame or version.

    """
    episode = episode_from_path(Path(folder))
    bag = _reader(episode.bag)
    header = _header(bag)
    if grid is not None:
        header.check_grid(grid, episode.path)
    if header.kind is not episode.kind:
        raise BagError(f'{episode.path} holds a {header.kind}, its name says {episode.kind}')
    try:
        read = _demonstration if header.kind is EpisodeKind.DEMO else _trial
        found = read(episode, bag, header)
        return replace(found, notes=(*found.notes, *_beside(episode)))
    except BagError:
        raise
    except ValueError as error:
        raise BagError(f'{episode.path}: {error}') from None


def read_task(
    task: TaskFolder, grid: Grid, say: Callable[[str], None] = lambda line: None,
) -> Iterator[Episode]:
    """
    Read all bags of a task, in order.

    Parameters
    ----------
    task : TaskFolder
    grid : Grid
        The workspace they must have been recorded in.
    say : callable, optional
        Is told in a line of every bag that is passed over because it teaches nothing.

    Raises
    ------
    BagError
        If one cannot be read, or is of another grid, frame or version.

    """
    for folder in task.episodes():
        try:
            yield read_episode(folder.path, grid)
        except NothingToLearnError as error:
            say(str(error))


def read_external_demonstration(
    path: Path | str, grid: Grid, topics: Mapping[str, str] | None = None, number: int = 0,
    speed_max: float = SPEED_MAX,
) -> Drive:
    """
    Learn from a drive that another recorder recorded.

    Parameters
    ----------
    path : Path
        A bag's folder or file: MCAP or sqlite3, compressed or not.
    grid : Grid
        The workspace; the poses must be in its frame.
    topics : mapping of str to str, optional
        Names of the topics that stand for `odom` (Odometry, PoseStamped or
        PoseWithCovarianceStamped), `neighbourhood` and `cmd_vel`.
    number : int
        Number of the episode it becomes.
    speed_max : float, [m/s]
        A robot that drives faster is none.

    Returns
    -------
    demonstration : Demonstration
    report : DemonstrationReport
        What of it was dropped.
    notes : tuple of str
        Sentences on what was passed over.

    Raises
    ------
    BagError
        If it cannot be read, a named topic is not in it, no robot can have driven so, or nothing
        is left to learn; `OutsideDriveError` if it leaves the workspace.

    """
    path, names = Path(path), dict(topics or {})
    bag = open_bag(path)
    for role, name in names.items():
        if name not in bag.topics:
            raise BagError(f'{path} has no topic {name} ({role}), '
                           f'there are: {", ".join(sorted(bag.topics)) or "none"}')
    return demonstration_of_bag(bag, path, names, grid, number, notes_on(bag), speed_max)


def demonstration_of_bag(
    bag: Bag, path: Path, names: Mapping[str, str], grid: Grid, number: int,
    said: tuple[str, ...] = (), speed_max: float = SPEED_MAX, begins: float = 0.0,
) -> Drive:
    """
    Learn from an opened bag of another recorder; see `read_external_demonstration`.

    Parameters
    ----------
    bag : Bag
    path : Path
        What an error calls it.
    names : mapping of str to str
        Topics by role.
    grid : Grid
    number : int
        Number of the episode it becomes.
    said : tuple of str
        Sentences on how it was opened; they end the notes, and an error.
    speed_max : float, [m/s]
        A robot that drives faster is none.
    begins : float, [s]
        Where in the recording the part that is read begins.

    """
    try:
        record, report, notes = _read_drive(InLogOrder(bag), names, grid, number, speed_max)
        return record, report, (*notes, *said)
    except OutsideWorkspaceError as error:
        raise OutsideDriveError('; '.join([f'{path}: {error}', *said]), error.fitting) from None
    except ValueError as error:
        where = '' if isinstance(error, BagError) else f'{path}: '
        remedy = remedy_for_external(error, begins)
        raise BagError('; '.join([f'{where}{error}{remedy}', *said])) from None


def find_topic(topics: Mapping[str, str], role: str, names: Mapping[str, str]) -> str:
    """
    Return the topic that plays a role: the one named, else the one whose name ends in it.

    Raises
    ------
    BagError
        If several end in it.

    """
    if role in names:
        return names[role]
    found = sorted(topic for topic in topics if topic.rpartition('/')[2] == role)
    if len(found) > 1:
        raise BagError(f'{role} may be {" or ".join(found)}: name one')
    return found[0] if found else f'/{role}'


def _reader(path: Path) -> BagReader:
    """Open a bag of ours; one whose recorder was stopped before it made the file is no error."""
    if path.parent.is_dir() and not os.path.lexists(path):
        others = [file for file in storage_files(path.parent) if file.suffix == '.mcap']
        if others:
            raise BagError(f'{path.parent} holds {others[0].name} and no {path.name}: give the '
                           f'folder or the file its name back')
        raise NothingToLearnError(f'{path.parent} holds no {path.name}: its recorder was stopped '
                                  f'at once')
    return BagReader(path)


def _beside(episode: EpisodeFolder) -> Iterator[str]:
    """Name the recordings beside that of a bag of ours, which holds one."""
    for file in storage_files(episode.path):
        if file.name != episode.bag.name:
            yield f'{file.name} lies beside it and is not read'


def _header(bag: BagReader) -> EpisodeHeader:
    for name, values in bag.metadata:
        if name == HEADER_NAME:
            try:
                return EpisodeHeader.from_mapping(values)
            except BagError as error:
                raise BagError(f'{bag.path}: {error}') from None
    if not bag.channels:
        raise NothingToLearnError(f'{bag.path} {_why_void(bag)}')
    raise BagError(f'{bag.path} is no bag of ours: it does not say on which grid it was recorded')


def _why_void(bag: BagReader) -> str:
    """Say why nothing is in a bag."""
    if bag.n_lost_bytes or bag.path.with_suffix('.mcap.cut').exists():
        return 'was cut off so early that no message is left in it'
    return 'is empty: its recorder was stopped at once'


def _demonstration(episode: EpisodeFolder, bag: BagReader, header: EpisodeHeader) -> Episode:
    status = last_of_demonstration(_messages(bag, 'trial', header.topics))
    label = _label(episode, status)
    _check_kept(episode, status, label)
    try:
        record, report, notes = _read_drive(
            bag, header.topics, header.grid, episode.number, header.speed_max)
    except BagError:
        raise
    except ValueError as error:
        remedy = remedy_for_own(error, episode.name)
        raise NothingToLearnError(f'{episode.path}: {error}{remedy}') from None
    return Episode(episode, header, record, report, status, notes, label)


def last_of_demonstration(messages: RawMessages) -> TrialStatus | None:
    """Return the last of the learner's own: those of trial 0 are none of the controller's."""
    return next((status for _, status in statuses(messages, True)
                 if status.trial == 0 and status.state in (State.RUNNING, State.ENDED)), None)


def _check_kept(episode: EpisodeFolder, last: TrialStatus | None, label: Label) -> None:
    """
    Refuse a demonstration that was begun and not kept, unless a person has judged it since.

    The learner brackets a demonstration by statuses; a bag without any of them counts as kept.
    """
    if label is Label.FAILURE:
        raise NothingToLearnError(f'{episode.path}: a person labelled the demonstration a failure')
    if last is not None and last.outcome is not Outcome.GOAL and label is not Label.SUCCESS:
        why = last.reason or 'its recorder was stopped'
        raise NothingToLearnError(f'{episode.path}: the demonstration was not kept: {why}')


def _label(episode: EpisodeFolder, status: TrialStatus | None) -> Label:
    """Return what a person said last: after the recording, else under way."""
    label = read_label(episode.path)
    if label is None:
        return Label.NONE if status is None else status.label
    return label


def _read_drive(
    bag: Bag, names: Mapping[str, str], grid: Grid, number: int, speed_max: float,
) -> Drive:
    try:
        return read_drive(_messages(bag, 'odom', names), _messages(bag, 'neighbourhood', names),
                          grid, number, speed_max)
    except NothingToLearnError as error:
        raise NothingToLearnError(f'{bag.path} {error}') from None


def _trial(episode: EpisodeFolder, bag: BagReader, header: EpisodeHeader) -> Episode:
    rows, n_refused, refusal = decision_table(
        _messages(bag, 'experience', header.topics), header.grid)
    number, ended = own_trial(_messages(bag, 'trial', header.topics), rows)
    _check_memory(episode, header, ended)
    own = rows[rows['trial'] == number]
    notes = [f'{counted(n_refused, "message")} refused, the first: {refusal}'] if n_refused else []
    if ended is not None and ended.decisions > len(own):
        notes.append(f'{ended.decisions - len(own)} of {ended.decisions} decisions are missing')
    outcome = ended.outcome if ended is not None and ended.outcome else Outcome.ABORTED
    label = _label(episode, ended)
    if label:
        notes.append(f'labelled {label} by a person')
    doubt = '' if outcome is Outcome.ABORTED else doubt_about(
        _messages(bag, 'odom', header.topics), header, own, ended,
        _messages(bag, 'control_field', header.topics))
    record = Trial(own, Outcome.ABORTED if doubt else judged(outcome, label), episode.number)
    return Episode(episode, header, record, None, ended, tuple(notes), label, doubt)


def _check_memory(
    episode: EpisodeFolder, header: EpisodeHeader, ended: TrialStatus | None,
) -> None:
    """Refuse a trial on the field of another memory; old bags do not say which one it was."""
    if not header.memory or ended is None or ended.outcome is Outcome.ABORTED:
        return
    problem = difference(ended.memory, header.memory)
    if problem:
        raise NothingToLearnError(f'{episode.path}: the controller {problem}')


def _messages(bag: Bag, role: str, names: Mapping[str, str]) -> RawMessages:
    return bag.messages(find_topic(bag.topics, role, names))
