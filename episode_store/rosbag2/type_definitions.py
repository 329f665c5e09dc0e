"""Message definitions and type hashes, read from the share folders of the installed packages."""

from collections.abc import Iterator
from functools import cache
import json
import os
from pathlib import Path
import re
import sys

from episode_store.rosbag2.errors import BagError

_TYPE_NAME = re.compile(r'([A-Za-z0-9_]+)/(?:msg/)?([A-Za-z0-9_]+)')
_FIELD = re.compile(r'^\s*([A-Za-z0-9_/]+)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z0-9_]+\s*(?!\s*=)')
_PRIMITIVES = frozenset({
    'bool', 'byte', 'char', 'float32', 'float64', 'int8', 'uint8', 'int16', 'uint16', 'int32',
    'uint32', 'int64', 'uint64', 'string', 'wstring'})
_RULE = '=' * 80


@cache
def message_definition(type_name: str) -> str:
    """
    Return the full definition of a message: its own text, then that of all it is made of.

    Parameters
    ----------
    type_name : str
        Such as ``nav_msgs/msg/Odometry``.

    Returns
    -------
    str
        Schema text of encoding ``ros2msg``, as rosbag2 writes it.

    Raises
    ------
    BagError
        If the package of a message is not installed.

    """
    return ''.join(_parts(type_name, set()))


def _parts(type_name: str, seen: set[str]) -> Iterator[str]:
    path = _message_path(type_name, '.msg')
    text = path.read_text(encoding='utf-8')
    yield text
    for needed in sorted(_dependencies(text, path.parent.parent.name)):
        if needed not in seen:
            seen.add(needed)
            yield f'\n{_RULE}\nMSG: {needed}\n'
            yield from _parts(needed, seen)


def _dependencies(text: str, package: str) -> set[str]:
    found = set()
    for line in text.splitlines():
        match = _FIELD.match(line.partition('#')[0])
        if match and match[1] not in _PRIMITIVES:
            found.add(match[1] if '/' in match[1] else f'{package}/{match[1]}')
    return found


@cache
def type_hash(type_name: str) -> str:
    """Return the RIHS01 hash of a message; empty where its package comes without."""
    try:
        described = json.loads(_message_path(type_name, '.json').read_text(encoding='utf-8'))
        hashes = {entry['type_name']: entry['hash_string'] for entry in described['type_hashes']}
        return str(hashes.get(type_name, ''))
    except (BagError, OSError, ValueError, KeyError, TypeError):
        return ''


def _message_path(type_name: str, suffix: str) -> Path:
    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise BagError(f'{type_name!r} is no message type, must be like nav_msgs/msg/Odometry')
    prefixes = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    for prefix in filter(None, prefixes):
        path = Path(prefix, 'share', match[1], 'msg', match[2] + suffix)
        if path.is_file():
            return path
    raise BagError(f'the definition of {type_name} is not installed, install {match[1]}')
