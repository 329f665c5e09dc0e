"""rosbag2's ``metadata.yaml``, version 9, as Jazzy writes it."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
import os
from pathlib import Path
from textwrap import indent
from typing import Any, Final

from episode_store.rosbag2.errors import BagError, error_line
from msgs_bridge.untrusted.files import read_text, replace_file
from msgs_bridge.untrusted.yaml_texts import text_from_yaml, yaml_from_text, yaml_node

NAME: Final = 'metadata.yaml'
#: The key under which all of it stands, and that of what people and programs have noted.
_BAG, _NOTES = 'rosbag2_bagfile_information', 'custom_data'
_FOREVER: Final = {'sec': 9223372036, 'nsec': 854775807}
#: rosbag2's starting time of a bag without messages.
_NEVER: Final = 2**63 - 1


@dataclass(frozen=True)
class OfferedQos:
    """
    The QoS that the publisher of a recorded topic offered; `ros2 bag play` offers the same.

    Parameters
    ----------
    history : str
        ``keep_last``, ``keep_all`` or ``unknown``.
    depth : int
        Messages kept.
    reliability : str
        ``reliable`` or ``best_effort``.
    durability : str
        ``volatile`` or ``transient_local``.

    """

    history: str = 'keep_last'
    depth: int = 10
    reliability: str = 'reliable'
    durability: str = 'volatile'

    def to_yaml(self) -> str:
        """Return the text that rosbag2 stores in a channel: a list of one profile."""
        return text_from_yaml([self.to_mapping()])

    def to_mapping(self) -> dict[str, Any]:
        """Return the profile."""
        return {**asdict(self), 'deadline': _FOREVER, 'lifespan': _FOREVER,
                'liveliness': 'automatic', 'liveliness_lease_duration': _FOREVER,
                'avoid_ros_namespace_conventions': False}


_LATCHED: Final = OfferedQos(depth=1, durability='transient_local')
_KNOWN: Final = {
    'control_field': _LATCHED, 'prototypes': _LATCHED, 'trial': _LATCHED, 'map': _LATCHED,
    'markers': _LATCHED, 'contact': _LATCHED, 'cmd_vel': OfferedQos(depth=1),
    'cmd_vel_requested': OfferedQos(depth=1), 'cmd_vel_teleop': OfferedQos(depth=1),
    'goal_pose': OfferedQos(depth=1), 'initialpose': OfferedQos(depth=1),
    'experience': OfferedQos(history='keep_all', depth=0),
    'neighbourhood': OfferedQos(depth=5, reliability='best_effort'),
}


def known_qos(topic: str) -> OfferedQos:
    """Return the QoS of one of our topics, by the last part of its name."""
    return _KNOWN.get(topic.rpartition('/')[2], OfferedQos())


def read_yaml(text: str) -> Any:
    """Return a text in YAML as plain types; None if it is no YAML, or exceeds the bounds."""
    try:
        return yaml_from_text(text)
    except ValueError:
        return None


def is_qos(text: str) -> bool:
    """Return True if a text is a list of offered QoS profiles as rosbag2 stores them."""
    profiles = read_yaml(text)
    names = OfferedQos().to_mapping().keys()
    return isinstance(profiles, list) and all(
        isinstance(profile, dict) and names <= profile.keys() and all(
            _FOREVER.keys() <= value.keys() for value in profile.values()
            if isinstance(value, dict)) for profile in profiles)


@dataclass(frozen=True)
class TopicSummary:
    """
    What a bag holds of a topic.

    Parameters
    ----------
    name, type_name, type_hash : str
        Such as ``/odom``, ``nav_msgs/msg/Odometry``, ``RIHS01_...``.
    qos : str
        YAML list of the offered profiles, the same text as in the channel's metadata.
    count : int
        Messages.

    """

    name: str
    type_name: str
    type_hash: str
    qos: str
    count: int

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry that rosbag2 stores for the topic."""
        return {'topic_metadata': {
            'name': self.name, 'type': self.type_name, 'serialization_format': 'cdr',
            'offered_qos_profiles': read_yaml(self.qos) or [],
            'type_description_hash': self.type_hash}, 'message_count': self.count}


@dataclass(frozen=True)
class BagSummary:
    """
    What a bag holds.

    Parameters
    ----------
    file : str
        Name of the MCAP file.
    start, end : int, [ns]
        Log times of the first and last message; both 0 without messages.
    topics : sequence of TopicSummary
        In the order of their channels.

    """

    file: str
    start: int
    end: int
    topics: Sequence[TopicSummary]

    @property
    def count(self) -> int:
        """Return the number of messages."""
        return sum(topic.count for topic in self.topics)

    def to_yaml(self) -> str:
        """Return the text that rosbag2 stores; in ``metadata.yaml`` it stands under one key."""
        return text_from_yaml(self.to_mapping())

    def to_mapping(self) -> dict[str, Any]:
        """Return the content that rosbag2 stores."""
        span = {
            'starting_time': {'nanoseconds_since_epoch': self.start if self.count else _NEVER},
            'duration': {'nanoseconds': self.end - self.start}, 'message_count': self.count}
        return {
            'version': 9, 'storage_identifier': 'mcap', 'duration': span['duration'], **span,
            'topics_with_message_count': [topic.to_mapping() for topic in self.topics],
            'compression_format': '', 'compression_mode': '', 'relative_file_paths': [self.file],
            'files': [{'path': self.file, **span}], _NOTES: None,
            'ros_distro': os.environ.get('ROS_DISTRO', 'jazzy')}


def custom_data(text: str) -> dict[str, str]:
    """Return the ``custom_data`` of a ``metadata.yaml``; ValueError if its text is no YAML."""
    said = yaml_from_text(text)
    for about in said.values() if isinstance(said, dict) else ():
        notes = about.get(_NOTES) if isinstance(about, dict) else None
        if isinstance(notes, dict):
            return {str(key): str(value) for key, value in notes.items()
                    if isinstance(key, str | int | float) and isinstance(value, str | int | float)}
    return {}


def with_note(text: str, key: str, value: str | None, path: Path | str) -> str:
    """
    Return the text of a ``metadata.yaml`` with one note set, or taken out (None).

    Everything else stays as written, so that a note taken out again leaves no trace.

    Raises
    ------
    BagError
        If the text has no ``custom_data``; ``path`` is named.

    """
    values: dict[str, str] = {}
    with suppress(ValueError):
        values = custom_data(text)
    if value is None and key not in values:
        return text
    text = text.removeprefix('\ufeff') + ('' if text.endswith('\n') else '\n')
    name, notes = _notes_in(text, path)
    is_block = notes.id == 'mapping' and not notes.flow_style
    entries = [entry for entry, _ in notes.value] if is_block else []
    first, last = _line_start(name.start_mark), (
        _line_start(notes.end_mark) if is_block else text.index('\n', notes.end_mark.index) + 1)
    starts = [*(_line_start(entry.start_mark) for entry in entries), last]
    kept = [text[start:end] for entry, start, end in zip(entries, starts, starts[1:], strict=False)
            if entry.value != key]
    note = {} if value is None else {key: value}
    if not kept:
        others = {other: said for other, said in values.items() if other != key}
        said = text_from_yaml({_NOTES: {**others, **note} or None})
        return text[:first] + indent(said, ' ' * name.start_mark.column) + text[last:]
    margin = ' ' * (len(kept[0]) - len(kept[0].lstrip(' ')))
    added = indent(text_from_yaml(note), margin) if note else ''
    return text[:starts[0]] + ''.join(kept) + added + text[last:]


def _line_start(mark: Any) -> int:
    return int(mark.index - mark.column)


def _notes_in(text: str, path: Path | str) -> Any:
    """Return the key and the value of ``custom_data`` as nodes."""
    with suppress(ValueError):
        for _, about in _pairs(yaml_node(text)):
            for key, value in _pairs(about):
                if key.value == _NOTES and not about.flow_style:
                    return key, value
    raise BagError(f'{path} has no custom_data: mend the bag with `experience repair '
                   f'{Path(path).parent}`')


def _pairs(node: Any) -> list[Any]:
    """Return the keys and values of a node; none if it is not a mapping."""
    return list(node.value) if getattr(node, 'id', '') == 'mapping' else []


def has_metadata(folder: Path) -> bool:
    """Return True if the folder of a bag has a readable ``metadata.yaml``."""
    try:
        content = read_yaml(read_text(folder / NAME, within=folder))
    except (FileNotFoundError, UnicodeDecodeError):
        return False
    found = content.get(_BAG) if isinstance(content, dict) else None
    return isinstance(found, dict) and {'version', 'message_count', 'files'} <= found.keys()


def write_metadata(folder: Path, summary: BagSummary) -> None:
    """
    Write ``metadata.yaml`` into the folder of a bag, whole or not at all; its notes are kept.

    Raises
    ------
    BagError
        If it cannot be written.

    """
    about, path = summary.to_mapping(), folder / NAME
    with suppress(OSError, ValueError):
        about[_NOTES] = custom_data(read_text(path, within=folder)) or None
    write_atomically(path, text_from_yaml({_BAG: about}).encode())


def write_atomically(path: Path, content: bytes) -> None:
    """
    Replace a file, whole or not at all, also when the power goes.

    Raises
    ------
    BagError
        If it cannot be written.

    """
    try:
        replace_file(path, content)
    except OSError as error:
        raise BagError(error_line('write', path, error)) from None
