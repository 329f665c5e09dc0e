"""Which parts of a parameter file are for a node: ROS drops the others without a word."""

from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
import re
from typing import Any, Final

from msgs_bridge.untrusted.files import read_text
from msgs_bridge.untrusted.yaml_texts import yaml_from_text

_PARAMETERS: Final = 'ros__parameters'
#: Nodes of ours, which may share a file, and how alike a name is that was meant to be another.
NODES: Final = ('sim_node', 'control_field_node', 'learner_node', 'teleop_node',
                'neighbourhood_node', 'localised_odometry_node')
_SLIP: Final = 0.82
#: So many sections are named in a line.
_MOST_NAMED: Final = 12


def sections_of(path: Path) -> dict[str, Any]:
    """
    Return what a parameter file holds, by the names of its sections.

    Names are joined as ROS joins them: ``robot1:`` around ``learner_node:`` is
    ``robot1/learner_node``. What is no parameter file has no sections; ROS says what is wrong
    with it.
    """
    with suppress(OSError, ValueError):
        return dict(_sections(yaml_from_text(read_text(path))))
    return {}


def _sections(content: Any, before: str = '') -> Iterator[tuple[str, Any]]:
    for key, value in content.items() if isinstance(content, Mapping) else ():
        if key == _PARAMETERS:
            yield before, value
        else:
            yield from _sections(value, f'{before}/{key}' if before else str(key))


def is_for(section: str, full_name: str) -> bool:
    """
    Return whether ROS gives a node what stands in a section.

    Parameters
    ----------
    section : str
        Its name: ``**`` stands for any number of names, ``*`` for one; a leading slash is left
        out at will.
    full_name : str
        Of the node, with its namespace.

    """
    pattern = re.escape('/' + section.lstrip('/'))
    pattern = pattern.replace(r'/\*\*', r'(/\w+)*').replace(r'/\*', r'/\w+')
    return re.fullmatch(pattern, full_name) is not None


def names_for_all(path: Path) -> set[str]:
    """Return the names in a parameter file's sections whose last part is a wildcard."""
    return {name for section, values in sections_of(path).items()
            if '*' in _last(section) for name in _flat(values)}


def _flat(values: Any, before: str = '') -> Iterator[str]:
    """Yield the full names in a tree of parameters."""
    for name, value in values.items() if isinstance(values, Mapping) else ():
        if isinstance(value, Mapping):
            yield from _flat(value, f'{before}{name}.')
        else:
            yield f'{before}{name}'


def problem_with_file(path: Path, full_name: str, names: Collection[str]) -> str:
    """
    Say that a file, or a section that was meant for a node, is for another one.

    Parameters
    ----------
    path : Path
        A file that ROS has read.
    full_name : str
        Of the node, with its namespace.
    names : collection of str
        What people may call it: its own name and that of its executable.

    Returns
    -------
    str
        Empty if there is nothing to say.

    """
    sections = list(sections_of(path))
    if not sections and path.exists() and not path.is_file():
        return ''  # a pipe, which ROS has read and nobody can read again
    if not sections:
        return f'{path} has no section, so that nothing in it is for {full_name}'
    meant = [section for section in sections if _is_meant(section, names)]
    if not any(is_for(section, full_name) for section in sections):
        return (f'no section of {path} is for {full_name}; its sections are '
                f'{_listed(sections)}' + _hint(meant, full_name))
    # One that names a namespace may well be for the same node of another robot.
    lost = [section for section in meant if '/' not in section.strip('/')
            and not is_for(section, full_name)]
    if lost and not any(is_for(section, full_name) for section in meant):
        return (f'the section {lost[0]} of {path} is not for {full_name}, and would change '
                f'nothing' + _hint(lost, full_name))
    return ''


def _is_meant(section: str, names: Collection[str]) -> bool:
    """Return whether a section has the name of a node, or nearly that."""
    nearest = get_close_matches(_last(section), [*names, *NODES], 1, _SLIP)
    return bool(nearest) and nearest[0] in names


def _last(section: str) -> str:
    return section.rpartition('/')[2]


def _hint(meant: list[str], full_name: str) -> str:
    if not meant:
        return f': /**/{_last(full_name)} would be for this node in every namespace'
    return f': call the section {meant[0]} {full_name} or /**/{_last(full_name)}'


def _listed(sections: list[str]) -> str:
    more = len(sections) - _MOST_NAMED
    return ', '.join(sections[:_MOST_NAMED]) + (f' and {more} more' if more > 0 else '')
