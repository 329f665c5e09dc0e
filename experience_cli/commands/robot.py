"""`experience robot`: a parameter file for a robot, from its URDF or its parameter files."""

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from control_field.robot.footprint import footprint_from_points
from experience_cli.errors import UserError
from experience_cli.output import Output
from experience_cli.robot.drive import add_plugins, add_wheels
from experience_cli.robot.facts import Facts
from experience_cli.robot.laser import add_laser
from experience_cli.robot.outline import outline_of
from experience_cli.robot.parameter_file import parameter_file
from experience_cli.robot.parameter_sources import add_parameter_file
from experience_cli.robot.urdf import Description, description_from_file

_BASES = ('base_footprint', 'base_link')


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    output = None if arguments.output is None else Output(arguments.output, '--output')
    facts, name = Facts(), 'robot'
    files: list[Path] = [arguments.file, *arguments.params]
    if arguments.source == 'from-urdf':
        robot = description_from_file(arguments.file)
        name = robot.name or name
        _add_files(arguments.params, facts)
        _add_description(robot, arguments, facts)
    else:
        _add_files(files, facts)
    title = (f'{name}, from {" and ".join(path.name for path in files)}. Look through it, above '
             f'all at what is TO BE CHECKED.')
    text = parameter_file(facts, title)
    for note in dict.fromkeys(facts.notes):
        print(f'experience robot: {note}', file=sys.stderr)
    if output is None:
        sys.stdout.write(text)
    else:
        output.write(text.encode())
    return 0


def _add_files(files: Sequence[Path], facts: Facts) -> None:
    for path in files:
        add_parameter_file(path, facts)


def _add_description(robot: Description, arguments: argparse.Namespace, facts: Facts) -> None:
    """Note what a URDF says; what was said before of wheels and frames counts more."""
    add_plugins(robot, facts)
    base = _base(robot, arguments.base_frame, facts)
    add_wheels(robot, base, facts)
    outline = outline_of(robot, base, arguments.packages)
    if outline is not None and outline.corners:
        facts.said['footprint'] = []
        try:
            footprint_from_points(list(outline.corners))
        except ValueError as error:
            raise UserError(f'{robot.path}: the {outline.source} is no outline: {error}') from None
        if outline.is_round:
            facts.add('disc', outline.reach, outline.source)
        else:
            facts.add('footprint', outline.corners, outline.source)
    elif facts.first('radius') is None and facts.first('footprint') is None:
        facts.notes.append(f'{robot.path} has no body whose outline can be read: robot_radius is '
                           f'a guess, measure it')
    facts.notes.extend([] if outline is None else outline.notes)
    add_laser(robot, base, arguments.laser, facts)


def _base(robot: Description, wanted: str | None, facts: Facts) -> str:
    """Return the link that is the robot's middle: the one named, that of odometry, or by name."""
    said = facts.first('base_frame')
    links = list(robot.collisions)
    if wanted is not None and wanted not in links:
        raise UserError(f'{robot.path}: --base-frame {wanted}: there is no such link; there are: '
                        f'{", ".join(sorted(links)[:30])}')
    names = ([wanted] if wanted else []) + ([said.value] if said else []) + [
        link for base in _BASES for link in links if link.rpartition('/')[2] == base]
    base = next((name for name in names if name in links), robot.root)
    if said is None or wanted:
        facts.said['base_frame'] = []
        facts.add('base_frame', base, '--base-frame' if wanted else 'a link of that name')
    return str(base)
