"""Cutting a bag to a span of time; the recording as it was is kept beside it."""

from contextlib import suppress
import os
from pathlib import Path
import shutil
from typing import Final

from msgs_bridge.bag_file import McapFile
from msgs_bridge.bag_folder import BagError, EpisodeFolder, error_line
from msgs_bridge.bag_metadata import BagSummary, NAME, write_metadata
from msgs_bridge.bag_records import BagReader
from msgs_bridge.bag_repair import summary_of_file
from msgs_bridge.episode_header import HEADER_NAME
from msgs_bridge.safe_files import read_bytes, sync_folder

#: What the whole recording is called beside the cut one; no reader takes it for a bag.
WHOLE: Final = '.whole'
#: Topics that say what a drive started from and how it ended: they hold whatever is cut.
_KEPT: Final = ('control_field', 'prototypes', 'trial')


def whole_path(episode: EpisodeFolder) -> Path:
    """Return where the whole recording of a bag that was cut is kept."""
    return episode.bag.with_name(episode.bag.name + WHOLE)


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
    reader = BagReader(episode.bag)
    headers = [values for name, values in reader.metadata if name == HEADER_NAME]
    path = folder / episode.bag.name
    try:
        file = McapFile(path, headers[0] if headers else None)
        try:
            for channel in reader.channels.values():
                file.add_channel(channel.topic, channel.schema.name, channel.schema.data,
                                 channel.metadata)
            for channel, log_time, publish_time, message in reader.records():
                inside = min(max(log_time, first), last)
                if inside == log_time or channel.topic.rpartition('/')[2] in _KEPT:
                    file.add(channel.topic, message, inside, publish_time)
        except OSError:
            file.abandon()
            raise
        summary = file.finish(path.name)
        (folder / NAME).write_bytes(read_bytes(episode.path / NAME, within=episode.path))
    except OSError as error:
        raise BagError(error_line('write', path, error)) from None
    write_metadata(folder, summary)
    return summary


def replace_recording(episode: EpisodeFolder, copy: Path, summary: BagSummary) -> None:
    """
    Let a cut copy take a bag's place; of the first one the whole recording is kept.

    Raises
    ------
    BagError
        If it cannot; the bag is then as it was.

    """
    whole = whole_path(episode)
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
    whole = whole_path(episode)
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
