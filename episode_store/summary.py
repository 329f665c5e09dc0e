"""A bag in one row: how it stands, when it was recorded, what it teaches."""

from dataclasses import asdict, dataclass
from typing import Any

from control_field.records import Demonstration, Outcome, Trial
from episode_store.episode import Content, Episode
from episode_store.errors import NothingToLearnError
from episode_store.rosbag2.errors import BagError, error_line


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


def summary_of(episode: Episode) -> Summary:
    """Sum up a bag; one that cannot be read says why in its note."""
    folder, damage = episode.folder, episode.damage
    about: dict[str, Any] = {
        'bag': folder.name, 'kind': str(folder.kind), 'path': str(folder.path)}
    try:
        about['size'] = folder.bag.stat().st_size if folder.bag.exists() else 0
        if damage.unreadable:
            raise BagError(damage.unreadable)
        about |= _recorded(episode)
        about |= _learnt(episode)
    except NothingToLearnError as error:
        about |= {'state': 'cut' if damage.cut else 'not kept', 'note': str(error)}
        return Summary(**about | ({'state': 'forgotten'} if damage.is_forgotten else {}))
    except (BagError, OSError) as error:
        note = error_line('read', folder.path, error) if isinstance(error, OSError) else error
        return Summary(**about | {'state': 'unreadable', 'note': str(note)})
    return Summary(**about | _damaged(episode, about))


def _recorded(episode: Episode) -> dict[str, Any]:
    """Return what was recorded."""
    return {'begun': episode.begun, 'duration': round(episode.duration, 3),
            'messages': sum(episode.bag.counts.values()), 'label': str(episode.label)}


def _damaged(episode: Episode, about: dict[str, Any]) -> dict[str, Any]:
    """Return state and note of a bag, with its damage."""
    damage, state, note = episode.damage, about['state'], about['note']
    if damage.gaps:
        note = '; '.join(filter(None, [str(damage.gaps), note]))
        state = 'incomplete' if state == 'kept' else state
    if damage.is_busy:
        state, note = 'recording', 'a learner records it just now'
    elif damage.cut:
        state, note = 'cut', f'mend it with `experience repair {episode.path}`'
    return {'state': 'forgotten' if damage.is_forgotten else state, 'note': note}


def _learnt(episode: Episode) -> dict[str, Any]:
    """Return what the learner would learn from a bag."""
    try:
        content = episode.content
    except NothingToLearnError as error:
        return {'state': 'not kept', 'note': str(error)}
    said = {'state': 'kept', 'note': '; '.join(
        [*(content.report.sentences() if content.report else []), *content.notes])}
    if isinstance(content.record, Demonstration):
        return said | {'cells': len(content.record.cells)}
    return said | _trial(content, content.record)


def _trial(content: Content, record: Trial) -> dict[str, Any]:
    ended = content.status.outcome if content.status else None
    values: dict[str, Any] = {'steps': record.n_steps, 'outcome': str(ended or Outcome.ABORTED)}
    if record.outcome is Outcome.ABORTED:
        why = content.status.reason if content.status else 'it was broken off'
        state = 'not kept' if content.doubt else 'aborted'
        values |= {'state': state, 'note': content.doubt or why}
    return values
