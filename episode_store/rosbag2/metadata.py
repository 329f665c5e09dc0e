"""rosbag2's ``metadata.yaml``, version 9, as Jazzy writes it."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
import os
from pathlib import Path
import re
from typing import Any, Final

from episode_store.rosbag2.errors import BagError, error_line
from msgs_bridge.untrusted.files import read_text, replace_file, yaml_from_text

NAME: Final = 'metadata.yaml'
_FOREVER: Final = '\n    sec: 9223372036\n    nsec: 854775807'
_EMPTY: Final = '""'
#: What stands under ``custom_data``, with all lines that are indented deeper.
_CUSTOM: Final = re.compile(r'^( *)custom_data:.*\n(?:\1 +.*\n)*', re.MULTILINE)
#: rosbag2's starting time of a bag without messages.
_NEVER: Final = 2**63 - 1


@dataclass(frozen=True)
class OfferedQos:
    """
    How a recorded topic's publisher offered it; `ros2 bag play` offers it the same way.

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
        """Return it as rosbag2 stores it in a channel: a list of one profile."""
        return (
            f'- history: {self.history}\n  depth: {self.depth}\n'
            f'  reliability: {self.reliability}\n  durability: {self.durability}\n'
            f'  deadline:{_FOREVER}\n  lifespan:{_FOREVER}\n  liveliness: automatic\n'
            f'  liveliness_lease_duration:{_FOREVER}\n'
            '  avoid_ros_namespace_conventions: false')


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
    """Return the profile that a topic of ours is offered with, by the last part of its name."""
    return _KNOWN.get(topic.rpartition('/')[2], OfferedQos())


def read_yaml(text: str) -> Any:
    """Return what a text in YAML says, in plain types; None if it is none, or has no bounds."""
    try:
        return yaml_from_text(text)
    except ValueError:
        return None


def is_qos(text: str) -> bool:
    """Tell whether a text is a list of offered profiles as rosbag2 stores them."""
    profiles = read_yaml(text)
    names = {line.partition(':')[0].strip(' -') for line in OfferedQos().to_yaml().splitlines()
             if not line.startswith('    ')}
    return isinstance(profiles, list) and all(
        isinstance(profile, dict) and names <= profile.keys() and all(
            {'sec', 'nsec'} <= value.keys() for value in profile.values()
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
        return '\n'.join(self._lines()) + '\n'

    def _lines(self) -> Iterator[str]:
        span = [
            f'starting_time:\n  nanoseconds_since_epoch: {self.start if self.count else _NEVER}',
            f'duration:\n  nanoseconds: {self.end - self.start}',
            f'message_count: {self.count}']
        yield 'version: 9'
        yield 'storage_identifier: mcap'
        yield from (span[1], span[0], span[2])
        yield 'topics_with_message_count:' if self.topics else 'topics_with_message_count: []'
        for topic in self.topics:
            yield from _topic_lines(topic)
        yield 'compression_format: ""\ncompression_mode: ""'
        yield f'relative_file_paths:\n  - {self.file}'
        yield f'files:\n  - path: {self.file}'
        yield from (_indented(text, 4) for text in span)
        yield f'custom_data: ~\nros_distro: {os.environ.get("ROS_DISTRO", "jazzy")}'


def _topic_lines(topic: TopicSummary) -> Iterator[str]:
    yield '  - topic_metadata:'
    yield f'      name: {topic.name}'
    yield f'      type: {topic.type_name}'
    yield '      serialization_format: cdr'
    yield '      offered_qos_profiles:' if topic.qos else '      offered_qos_profiles: []'
    if topic.qos:
        yield _indented(topic.qos, 8)
    yield f'      type_description_hash: {topic.type_hash or _EMPTY}'
    yield f'    message_count: {topic.count}'


def _indented(text: str, n: int) -> str:
    return '\n'.join(' ' * n + line for line in text.splitlines())


def custom_data(text: str) -> dict[str, str]:
    """Return what people and programs have noted in a ``metadata.yaml``, given its text."""
    block = _CUSTOM.search(text)
    whole = read_yaml(block[0]) if block else None
    values = whole.get('custom_data') if isinstance(whole, dict) else None
    if not isinstance(values, dict):
        return {}
    # A few lines of YAML can stand for lists that no memory holds.
    return {str(key): str(value) for key, value in values.items()
            if isinstance(key, str | int | float) and isinstance(value, str | int | float)}


def with_custom_data(text: str, values: Mapping[str, str], path: Path) -> str:
    """
    Return the text of a ``metadata.yaml`` with other notes in it.

    Raises
    ------
    BagError
        If it has no place for any; ``path`` is named.

    """
    import yaml  # type: ignore[import-untyped, unused-ignore]

    block = _CUSTOM.search(text)
    if block is None:
        raise BagError(f'{path} has no custom_data: mend the bag with `experience repair '
                       f'{path.parent}`')
    lines = _indented(yaml.safe_dump(dict(values), default_style='"', width=2**31), len(
        block[1]) + 2) + '\n' if values else ''
    head = f'{block[1]}custom_data:' + ('\n' if lines else ' ~\n')
    return text[:block.start()] + head + lines + text[block.end():]


def with_note(text: str, key: str, value: str | None, path: Path) -> str:
    """
    Return the text of a ``metadata.yaml`` with one note set, or taken out (None).

    The other notes stay as they are written, so that one taken out again leaves no trace.

    Raises
    ------
    BagError
        If it has no place for any; ``path`` is named.

    """
    values = custom_data(text)
    if value is None and key not in values:
        return text
    block = _CUSTOM.search(text)
    head, *lines = block[0].splitlines(keepends=True) if block else ['']
    own = re.compile(rf'\s*["\']?{re.escape(key)}["\']?\s*:')
    others = [line for line in lines if not own.match(line)]
    if block is None or head.strip() != 'custom_data:' or not others:
        values.pop(key, None)
        return with_custom_data(text, values | ({} if value is None else {key: value}), path)
    indent = ' ' * (len(others[0]) - len(others[0].lstrip()))
    note = '' if value is None else f'{indent}"{key}": "{value}"\n'
    return text[:block.start()] + head + ''.join(others) + note + text[block.end():]


def has_metadata(folder: Path) -> bool:
    """Tell whether a bag's folder has a ``metadata.yaml`` that can be read."""
    try:
        content = read_yaml(read_text(folder / NAME, within=folder))
    except (FileNotFoundError, UnicodeDecodeError):
        return False
    found = content.get('rosbag2_bagfile_information') if isinstance(content, dict) else None
    return isinstance(found, dict) and {'version', 'message_count', 'files'} <= found.keys()


def write_metadata(folder: Path, summary: BagSummary) -> None:
    """
    Write ``metadata.yaml`` into a bag's folder, whole or not at all; notes that are in it stay.

    Raises
    ------
    BagError
        If it cannot be written.

    """
    text = 'rosbag2_bagfile_information:\n' + _indented(summary.to_yaml(), 2) + '\n'
    path = folder / NAME
    with suppress(OSError, UnicodeDecodeError):
        text = with_custom_data(text, custom_data(read_text(path, within=folder)), path)
    write_atomically(path, text.encode())


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
