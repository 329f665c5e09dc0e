"""Mending bags whose recorder was killed or ran out of disk."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
import os
from pathlib import Path
import re
from typing import Final

from control_field.words import counted
from episode_store.episode import Episode
from episode_store.errors import UnwritableError
from episode_store.gaps import note_gaps
from episode_store.header import LOST_NAME
from episode_store.rosbag2.errors import BagError, error_line, mcap_path
from episode_store.rosbag2.mcap_scan import Channel
from episode_store.rosbag2.metadata import (
    BagSummary, has_metadata, is_qos, known_qos, NAME, TopicSummary, write_metadata)
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.type_definitions import message_definition
from episode_store.rosbag2.writer import HEADER_NAME, McapFile, TOPIC
from episode_store.task_folder import TaskFolder
from msgs_bridge.untrusted.files import replacing

#: Ending of the file as it was found, where bytes of it had to be dropped.
CUT: Final = '.mcap.cut'

_TYPE: Final = re.compile(r'\w+(/msg|/srv)?/\w+', re.ASCII)
_HASH: Final = re.compile(r'RIHS01_[0-9a-f]{64}')


@dataclass(frozen=True)
class RepairReport:
    """
    What was found in a bag and done about it.

    Parameters
    ----------
    folder : Path
        The bag.
    changed : bool
        Whether anything was done.
    damage : str
        What was wrong with the MCAP file; empty if it was whole.
    complete : bool
        Whether no message is missing.
    n_messages : int
        Messages that are readable.
    n_lost_bytes : int
        Bytes that are not, and may have held messages.
    last_time : int or None, [ns]
        Log time of the last readable message.
    kept : Path or None
        Where the file as it was found is kept; only if bytes of it were dropped.

    """

    folder: Path
    changed: bool
    damage: str
    complete: bool
    n_messages: int
    n_lost_bytes: int
    last_time: int | None
    kept: Path | None

    def __str__(self) -> str:
        """Say it in one line."""
        if not self.changed:
            return f'{self.folder}: whole, {counted(self.n_messages, "message")}'
        if not self.damage:
            return f'{self.folder}: {NAME} was missing or broken, written anew; no message lost'
        if not self.n_messages and not self.n_lost_bytes:
            return f'{self.folder}: mended, it was empty: its recorder was stopped at once'
        if not self.n_messages:
            return f'{self.folder}: no message could be saved, {self.damage}; {self._lost()}'
        found = (f'{self.folder}: mended, {self.damage}; {counted(self.n_messages, "message")} '
                 f'kept')
        if self.complete:
            return f'{found}, no message lost'
        last = '' if self.last_time is None else f', the last at {self.last_time / 1e9:.3f} s'
        return f'{found}{last}; {self._lost()}'

    def _lost(self) -> str:
        if self.kept is None:
            return 'what came after is missing'
        return (f'{counted(self.n_lost_bytes, "byte")} could not be read, the file as it was is '
                f'kept in {self.kept.name}')


def repair_bag(folder: Path | str) -> RepairReport:
    """
    Mend a bag of ours; a whole one is left alone, so that mending again changes nothing.

    The MCAP file is written anew from all that is readable and takes the old one's place at
    once. Where bytes had to be dropped, the old file is kept beside it, ending in ``.cut``.

    Parameters
    ----------
    folder : Path
        The bag's folder.

    Raises
    ------
    UnwritableError
        If it cannot be written.
    BagError
        If it cannot be read, or is no bag of ours.

    """
    folder = Path(folder)
    path = mcap_path(folder)
    try:
        if not path.exists():
            _check_empty(folder)
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644))
        reader = BagReader(path, verify=True)
        kept = path.with_suffix(CUT) if reader.damage and reader.n_lost_bytes else None
        summary = _mended(reader, path, kept) if reader.damage else (
            summary_of_file(path, path.name))
        changed = bool(reader.damage) or not has_metadata(folder)
    except OSError as error:
        raise UnwritableError(error_line('repair', folder, error)) from None
    if changed:
        _note(folder, summary)
    return RepairReport(
        folder, changed, reader.damage, reader.complete, summary.count,
        reader.n_lost_bytes, summary.end if summary.count else None, kept)


def _mended(reader: BagReader, path: Path, kept: Path | None) -> BagSummary:
    """Let what is readable of a bag take its place."""
    with replacing(path) as draft:
        summary = rewrite(reader, draft, path.name)
        if kept is not None and not kept.exists():
            os.link(path, kept)
    return summary


def _note(folder: Path, summary: BagSummary) -> None:
    """Write what a mended bag holds and lacks beside it."""
    try:
        write_metadata(folder, summary)
    except BagError as error:
        raise UnwritableError(str(error)) from None
    with suppress(BagError):  # there may be nothing in it
        note_gaps(Episode.at(folder))


def repair_task(task: TaskFolder) -> list[RepairReport]:
    """
    Mend all bags of a task that need it.

    Returns
    -------
    list of RepairReport
        One for each bag that was mended, in order.

    Raises
    ------
    BagError
        See `repair_bag`.

    """
    damaged = [folder for folder in task.episodes() if not Episode(folder).is_closed]
    reports = [repair_bag(folder.path) for folder in damaged]
    return [report for report in reports if report.changed]


def _check_empty(folder: Path) -> None:
    """Refuse to put a bag into a folder that holds something else."""
    if not folder.is_dir():
        raise BagError(f'there is no bag {folder}')
    others = sorted(path.name for path in folder.iterdir() if path.suffix in ('.mcap', '.db3'))
    if others:
        raise BagError(f'{folder} is no bag of ours: it holds {others[0]}')


def rewrite(
    reader: BagReader, path: Path, name: str,
    moved: Callable[[int, Channel, int], int | None] = lambda place, channel, log_time: log_time,
) -> BagSummary:
    """
    Write all that is readable of a bag into another file.

    Parameters
    ----------
    reader : BagReader
    path : Path
        The new file.
    name : str
        What it will be called.
    moved : callable
        Returns the log time, [ns], that a message gets, given its place in the bag, channel and
        log time; None leaves it out.

    Raises
    ------
    OSError
        If it cannot be written.

    """
    headers = [values for key, values in reader.metadata if key == HEADER_NAME]
    file = McapFile(path, headers[0] if headers else None)
    try:
        for channel in filter(_is_sound, reader.channels.values()):
            file.add_channel(channel.topic, channel.schema.name, _sound_definition(channel),
                             _sound_metadata(channel))
        for place, (channel, log_time, publish_time, message) in enumerate(reader.records()):
            at = moved(place, channel, log_time)
            if at is not None and _is_sound(channel):
                file.add(channel.topic, message, at, publish_time)
        for key, values in reader.metadata:
            if key == LOST_NAME:
                file.add_metadata(key, values)
    except OSError:
        file.abandon()
        raise
    return file.finish(name)


def _is_sound(channel: Channel) -> bool:
    """Return whether a channel's own description is undamaged."""
    return bool(TOPIC.fullmatch(channel.topic) and _TYPE.fullmatch(channel.schema.name))


def _sound_definition(channel: Channel) -> bytes:
    """Return the definition of a channel's type; where it was hit, as it is installed here."""
    try:
        channel.schema.data.decode()
    except UnicodeDecodeError:
        with suppress(BagError):
            return message_definition(channel.schema.name).encode()
        return channel.schema.data.decode(errors='replace').encode()
    return channel.schema.data


def _sound_metadata(channel: Channel) -> dict[str, str]:
    """Return the metadata of a channel; what was hit of them is as for a topic of ours."""
    values = dict(channel.metadata)
    qos, type_hash = (values.get(name, '') for name in ('offered_qos_profiles', 'topic_type_hash'))
    if qos and not is_qos(qos):
        values['offered_qos_profiles'] = known_qos(channel.topic).to_yaml()
    if type_hash and not _HASH.fullmatch(type_hash):
        values['topic_type_hash'] = ''
    return values


def summary_of_file(path: Path, name: str) -> BagSummary:
    """
    Summarise a whole file.

    Parameters
    ----------
    path : Path
        The MCAP file.
    name : str
        What it is, or will be, called.

    Raises
    ------
    BagError
        If it cannot be read.

    """
    reader = BagReader(path)
    times = [reader.messages_of([number]).log_times for number in reader.channels]
    used = [times_of for times_of in times if len(times_of)]
    return BagSummary(
        name, min((int(times_of.min()) for times_of in used), default=0),
        max((int(times_of.max()) for times_of in used), default=0),
        [TopicSummary(channel.topic, channel.schema.name,
                      channel.metadata.get('topic_type_hash', ''),
                      channel.metadata.get('offered_qos_profiles', ''), len(times_of))
         for channel, times_of in zip(reader.channels.values(), times, strict=True)])
