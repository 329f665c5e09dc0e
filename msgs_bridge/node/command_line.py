"""A node's command line: its page of help, and what nobody would ever have looked at."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
import sys
import textwrap
from typing import Any, Final

from msgs_bridge.node.parameter_files import names_for_all, problem_with_file
from msgs_bridge.node.remaps import idle_rules, problem_with_special

#: How alike a name has to be to one of this node to be taken for a slip of the pen.
_SLIP: Final = 0.82
#: Names of our nodes that are so much like one of another node, and no slip in a section for all.
ALIKE: Final = frozenset({
    'seed', 'speed', 'pose_frame_id', 'moves', 'movers', 'simulator', 'world', 'worlds'})

PAGE: Final = """\
{name}: {does}

  {name} --ros-args {example}
  {name} --ros-args --params-file FILE -r __ns:=/robot1 -r odom:=wheels/odom

Parameters; doc/parameters.md tells default, unit, range and meaning of each:
{parameters}"""


@dataclass(frozen=True)
class Program:
    """
    What a node says about itself before it is one.

    Parameters
    ----------
    name : str
        Of the executable; stands before a line about a mistake.
    does : str
        What it does, in a sentence.
    example : str
        ROS arguments that make sense.
    parameters : tuple of str
        Names of its parameters.

    """

    name: str
    does: str
    example: str
    parameters: tuple[str, ...]

    @property
    def page(self) -> str:
        """Return the page of help."""
        names = textwrap.fill(', '.join(self.parameters), 98, initial_indent='  ',
                              subsequent_indent='  ', break_on_hyphens=False)
        return PAGE.format(name=self.name, does=self.does, example=self.example, parameters=names)


def names_of(*kinds: Any) -> tuple[str, ...]:
    """Return the names of the fields of dataclasses."""
    return tuple(spec.name for kind in kinds for spec in fields(kind))


def split_arguments(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the plain arguments and those of ROS, which stand between --ros-args and --."""
    plain: list[str] = []
    ros: list[str] = []
    target = plain
    for argument in arguments:
        if target is plain and argument == '--ros-args':
            target = ros
        elif target is ros and argument == '--':
            target = plain
        else:
            target.append(argument)
    return plain, ros


class Given:
    """What the command line gives a node; nothing before `take`."""

    def __init__(self) -> None:
        self.plain: list[str] = []
        self.program = ''
        self._ros: list[str] = []

    def take(self, args: Sequence[str] | None) -> None:
        """Take arguments apart, by default those of the process; the program's may be first."""
        has_program = args is None or (len(args) > 0 and not args[0].startswith('-'))
        self.plain, self._ros = split_arguments((sys.argv if args is None else args)[has_program:])

    @property
    def wants_help(self) -> bool:
        """Return whether the page of help is asked for."""
        return '-h' in self.plain or '--help' in self.plain

    def unknown(self, names: Collection[str]) -> tuple[list[str], list[str]]:
        """
        Sort names that a node has no parameter of.

        Returns
        -------
        mistaken : list of str
            Given to this node: by ``-p``, or under its name in a file.
        shared : list of str
            Given in a file to any node; another one may have them.

        """
        singly = {name for rule in self._values_of('-p', '--param')
                  for name in [rule.partition(':=')[0].rpartition(':')[2]]}
        for_all = {name for path in self._values_of('--params-file')
                   for name in names_for_all(Path(path))}
        mistaken = [name for name in names if name in singly or name not in for_all]
        return mistaken, [name for name in names if name not in mistaken]

    def problems(self, full_name: str) -> list[str]:
        """
        Say what was given to no node of this process: a file, a section, a parameter.

        Parameters
        ----------
        full_name : str
            Of the node, with its namespace.

        """
        names = list(filter(None, (full_name.rpartition('/')[2], self.program)))
        files = dict.fromkeys(self._values_of('--params-file'))
        problems = [problem_with_file(Path(path), full_name, names) for path in files]
        for rule in self._values_of('-p', '--param'):
            given = rule.partition(':=')[0]
            node, _, name = given.rpartition(':')
            if node and f'/{node}' != full_name:
                problems.append(f'-p {given} is for /{node}, this node is {full_name}: leave '
                                f'{node}: out, -p {name}:=... is for this node')
        return list(filter(None, problems))

    @property
    def remappings(self) -> list[str]:
        """Return the remappings, such as ``odom:=wheels/odom``."""
        return list(self._values_of('-r', '--remap'))

    def _values_of(self, *options: str) -> Iterator[str]:
        for option, value in zip(self._ros, self._ros[1:], strict=False):
            if option in options:
                yield value


#: The command line of this process, once it has begun as a node.
_given: Final = Given()


def begin(program: Program, args: list[str] | None) -> None:
    """
    Look at the command line before there is a node.

    Raises
    ------
    ValueError
        If there is an argument that nothing would look at.
    SystemExit
        With code 0, after the page of help, where that is asked for.

    """
    _given.take(args)
    _given.program = program.name
    if _given.wants_help:
        print(program.page)
        raise SystemExit(0)
    if _given.plain:
        raise ValueError(
            f'what is {_given.plain[0]!r}? Parameters are given as --ros-args -p NAME:=VALUE, '
            f'{program.name} --help lists them')
    if problem := problem_with_special(_given.remappings):
        raise ValueError(problem)


def check_names(node: Any) -> None:
    """
    Look for parameters that were given and that this node does not have; call it once declared.

    Those of other nodes may come along with the ones they share; a warning says so.

    Raises
    ------
    ValueError
        If one that was given to this node is all but one of its own, or a whole file or section
        is for another node: a limit that is misspelt would be none.

    """
    if problems := _given.problems(node.get_fully_qualified_name()):
        raise ValueError('; '.join(problems))
    names = [name for name in node._parameter_overrides if not node.has_parameter(name)]
    given, shared = _given.unknown(names)
    known = sorted(node.get_parameters_by_prefix(''))
    mistaken = [name for name in given if get_close_matches(name, known, 1, _SLIP)]
    if mistaken:
        raise ValueError('; '.join(f'there is no parameter {_with_hint(name, known)}'
                                   for name in mistaken) + ' (--help lists all)')
    logger = node.get_logger()
    for name in given:
        logger.warning(f'there is no parameter {name!r} here, it changes nothing (--help lists '
                       f'all)')
    for name in shared:
        if name not in ALIKE and get_close_matches(name, known, 1, _SLIP):
            logger.warning(f'a parameter file gives {node.get_name()}, too, '
                           f'{_with_hint(name, known)}')


def check_remappings(node: Any) -> None:
    """Say which remappings change nothing; call it once a node has all its topics and services."""
    warnings, notes = idle_rules(_given.remappings, node, _given.program)
    for text in warnings:
        node.get_logger().warning(text)
    for text in notes:
        node.get_logger().info(text)


def _with_hint(name: str, known: Collection[str]) -> str:
    """Return a name, and which ones may have been meant."""
    near = get_close_matches(name, known, 2)
    return f'{name!r}' + (f' (is {" or ".join(near)} meant?)' if near else '')
