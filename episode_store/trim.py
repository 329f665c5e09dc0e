"""Cutting a bag to a span of time; the recording as it was is kept beside it."""

from collections.abc import Collection
from contextlib import suppress
import os
from pathlib import Path
import shutil
from typing import Final

from episode_store.repair import rewrite, summary_of_file
from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.mcap_scan import Channel
from episode_store.rosbag2.metadata import BagSummary, NAME, write_metadata
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import EpisodeFolder
from msgs_bridge.untrusted.files import read_bytes, replacing, sync_folder

#: Topics that say what a drive started from and how it ended: they hold whatever is cut.
_KEPT: Final = ('control_field', 'prototypes', 'trial')


def cut_copy(episode: EpisodeFolder, folder: Path, first: int, last: int) -> BagSummary:
    """
    Write the messages of a span into a bag of the same name elsewhere, byte for byte.

    Parameters
    ----------
    episode : EpisodeFolder
        The bag.
    folder : Path
        An empty folder with the bag's own name.
    first, last : int, [ns]
        Log times, both within the span. What stands before and after it on `control_field`,
        `prototypes` and `trial` is moved to its ends: it says what the drive was.

    Raises
    ------
    BagError
        If it cannot be read or written.

    """
    def moved(place: int, channel: Channel, log_time: int) -> int | None:
        inside = min(max(log_time, first), last)
        is_kept = inside == log_time or channel.topic.rpartition('/')[2] in _KEPT
        return inside if is_kept else None

    path = folder / episode.bag.name
    try:
        summary = rewrite(BagReader(episode.bag), path, path.name, moved)
        (folder / NAME).write_bytes(read_bytes(episode.path / NAME, within=episode.path))
    except OSError as error:
        raise BagError(error_line('write', path, error)) from None
    write_metadata(folder, summary)
    return summary


def drop_messages(episode: EpisodeFolder, places: Collection[int]) -> None:
    """
    Take messages out of a bag of ours that was just closed.

    Parameters
    ----------
    episode : EpisodeFolder
        The bag.
    places : collection of int
        Which of its messages, in the order they were written.

    Raises
    ------
    BagError
        If it cannot be read or written.

    """
    def others(place: int, channel: Channel, log_time: int) -> int | None:
        return None if place in places else log_time

    try:
        with replacing(episode.bag) as draft:
            summary = rewrite(BagReader(episode.bag), draft, episode.bag.name, others)
    except OSError as error:
        raise BagError(error_line('write', episode.bag, error)) from None
    write_metadata(episode.path, summary)


def replace_recording(episode: EpisodeFolder, copy: Path, summary: BagSummary) -> None:
    """
    Let a cut copy take a bag's place; of the first one the whole recording is kept.

    Raises
    ------
    BagError
        If it cannot; the bag is then as it was.

    """
    whole = episode.whole
    try:
        if not whole.exists():
            os.link(episode.bag, whole)
        copy.replace(episode.bag)
        sync_folder(episode.path)
    except OSError as error:
        raise BagError(error_line('cut', episode.bag, error)) from None
    write_metadata(episode.path, summary)


def restore(episode: EpisodeFolder) -> None:
    """
    Put the whole recording back.

    Raises
    ------
    BagError
        If the bag was not cut, or it cannot be written.

    """
    whole = episode.whole
    if not whole.exists():
        raise BagError(f'{episode.path} was not cut: there is no {whole.name}')
    summary = summary_of_file(whole, episode.bag.name)
    try:
        whole.replace(episode.bag)
        sync_folder(episode.path)
    except OSError as error:
        raise BagError(error_line('restore', episode.bag, error)) from None
    write_metadata(episode.path, summary)


def drop_draft(folder: Path) -> None:
    """Remove the folder of a copy, whatever is left of it."""
    with suppress(OSError):
        shutil.rmtree(folder)
