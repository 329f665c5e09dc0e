"""`experience trim`: cut a demonstration to what shall be learnt from."""

import argparse
from pathlib import Path

import numpy as np

from control_field.records import Demonstration
from control_field.words import counted, sentences
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.gaps import note_gaps
from episode_store.lock import changing, TRIM
from episode_store.relearn import relearnt_sentence
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.task_folder import EpisodeFolder, EpisodeKind
from episode_store.trim import cut_copy, drop_draft, replace_recording, restore
from experience_cli.bag_argument import find_whole_bag, named
from experience_cli.errors import UserError


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    given = arguments.first is not None or arguments.last is not None
    if given == arguments.undo:
        raise UserError('say --from or --to, or both, or --undo')
    episode = find_whole_bag(arguments.bag, arguments.bags)
    if episode.kind is not EpisodeKind.DEMO:
        raise UserError(f'{episode.name} is a trial: only a demonstration can be cut (`experience '
                        f'forget` un-teaches a trial)')
    with changing(episode.task_path):
        if arguments.undo:
            print(_restored(episode))
        else:
            print(f'{trim(episode, arguments.first, arguments.last)} The whole recording is kept '
                  f'beside it; `experience trim --undo {named(arguments.bag, arguments.bags)}` '
                  f'puts it back.')
        note_gaps(Episode(episode))
        print(relearnt_sentence(episode.task))
    return 0


def _restored(episode: EpisodeFolder) -> str:
    restore(episode)
    return f'{episode.name} is whole again'


def trim(episode: EpisodeFolder, first: float | None, last: float | None) -> str:
    """
    Cut a demonstration; return what was done.

    Parameters
    ----------
    episode : EpisodeFolder
    first, last : float or None, [s]
        From the first odometry; None for its start or end.

    Raises
    ------
    UserError
        If the span is empty or not within the drive, or nothing would be left to learn from.
    BagError
        If the bag cannot be read or written.

    """
    span = _span(episode, first, last)
    draft = episode.path.parent / f'{TRIM}{episode.number:04d}' / episode.path.name
    drop_draft(draft.parent)
    try:
        _make(draft)
        summary = cut_copy(episode, draft, *span)
        cut = Episode.at(draft)
        left = cut.content
        replace_recording(episode, draft / episode.bag.name, summary)
    except NothingToLearnError as error:
        raise UserError(f'{episode.name} is left as it was, so cut it teaches nothing: '
                        f'{error.why}') from None
    finally:
        drop_draft(draft.parent)
    # Only demonstrations are cut, and of those there is a report.
    assert isinstance(left.record, Demonstration)
    assert left.report is not None
    grid = cut.header.grid
    start, goal = ('({:.2f}, {:.2f})'.format(*grid.world_from_cell(*cell))
                   for cell in left.record.cells[[0, -1]].tolist())
    steps = counted(left.report.n_steps, 'step')
    return sentences([f'{episode.name} is cut: {steps} are left, from {start} to {goal} m',
                      *left.report.sentences()])


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise BagError(error_line('make', folder, error)) from None


def _span(episode: EpisodeFolder, first: float | None, last: float | None) -> tuple[int, int]:
    """Return the log times of the first and last odometry within a span of seconds."""
    recording = Episode(episode)
    low = 0.0 if first is None else first
    high = recording.duration if last is None else last
    if not 0.0 <= low < high or low >= recording.duration:
        raise UserError(f'--from {low:g} --to {high:g}: must be a span within 0 and '
                        f'{recording.duration:.2f} s')
    seconds = recording.poses.stamps - recording.start
    inside = np.flatnonzero((seconds >= low - 1e-6) & (seconds <= high + 1e-6))
    if not len(inside):
        raise UserError(f'{episode.name} has no odometry between {low:g} and {high:g} s')
    if len(inside) == len(seconds):
        raise UserError(f'nothing to cut: {episode.name} lasts from 0 to '
                        f'{recording.duration:.2f} s, all of it is within {low:g} to {high:g} s')
    times = recording.poses.log_times[inside]
    return int(times.min()), int(times.max())
