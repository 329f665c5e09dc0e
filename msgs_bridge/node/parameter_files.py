"""Which parts of a parameter file are for a node: ROS drops the others without a word."""

from collections.abc import Collection, Iterator
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
import re
from typing import Any, Final

from msgs_bridge.untrusted.files import read_text
from msgs_bridge.untrusted.yaml_texts import yaml_node

_PARAMETERS: Final = 'ros__parameters'
#: Nodes of ours, which may share a file, and how alike a name is that was meant to be another.
NODES: Final = ('sim_node', 'control_field_node', 'learner_node', 'teleop_node',
                'neighbourhood_node', 'localised_odometry_node', 'page_node')
_SLIP: Final = 0.82
#: So many sections are named in a line.
_MOST_NAMED: Final = 12


def sections_of(path: Path) -> dict[str, dict[str, list[int]]]:
    """
    Return the sections of a parameter file: full names of parameters, and the lines that set them.

    Names are joined as ROS joins them: ``robot1:`` around ``learner_node:`` is
    ``robot1/learner_node``, and sections of one name are one. What is no parameter file has no
    sections; ROS says what is wrong with it.
    """
    sections: dict[str, dict[str, list[int]]] = {}
    with suppress(OSError, ValueError):
        for section, values in _sections(yaml_node(read_text(path))):
            lines = sections.setdefault(section, {})
            for name, line in _flat(values):
                lines.setdefault(name, []).append(line)
    return sections


def _sections(node: Any, before: str = '') -> Iterator[tuple[str, Any]]:
    for key, value in _pairs(node):
        if key.value == _PARAMETERS:
            yield before, value
        else:
            yield from _sections(value, f'{before}/{key.value}' if before else str(key.value))


def _pairs(node: Any) -> list[tuple[Any, Any]]:
    """Return keys and values of a node of YAML; of any but a mapping, none."""
    return node.value if getattr(node, 'id', '') == 'mapping' else []


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
    return {name for section, lines in sections_of(path).items()
            if '*' in _last(section) for name in lines}


def _flat(node: Any, before: str = '') -> Iterator[tuple[str, int]]:
    """Yield the full names in a tree of parameters, and their lines."""
    for key, value in _pairs(node):
        if getattr(value, 'id', '') == 'mapping':
            yield from _flat(value, f'{before}{key.value}.')
        else:
            yield f'{before}{key.value}', int(key.start_mark.line) + 1


def problem_with_file(path: Path, full_name: str, names: Collection[str]) -> str:
    """
    Say that a file, or a section meant for a node, is for another one, or sets a value twice.

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
    found = sections_of(path)
    sections = list(found)
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
    return next((f'the section {section} of {path} sets {name} twice, in line {lines[0]} and in '
                 f'line {lines[1]}: keep one of them'
                 for section, names_in in found.items() if is_for(section, full_name)
                 for name, lines in names_in.items() if len(lines) > 1), '')


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
