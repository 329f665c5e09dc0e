"""`experience diff`: two fields as arrows and numbers."""

import argparse
from functools import partial
import json
from pathlib import Path
from typing import Any

from control_field.words import counted
from experience_cli.bag_argument import is_external, named_path
from experience_cli.errors import UserError
from experience_cli.external_bags import borrowed, wanted_option
from experience_cli.field_comparison import Comparison, Side, side_from, side_from_bags
from experience_cli.figures.comparison_figure import comparison_figure
from experience_cli.output import write_output
from experience_cli.terminal import table_lines


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    out = arguments.out
    if out.suffix != '.png':
        raise UserError(f'--out {out}: must end in .png')
    found = Comparison.of(*_sides(arguments))
    write_output(out, partial(comparison_figure(found).savefig, format='png'))
    about = {**found.to_json(), 'figure': str(out)}
    print(json.dumps(about, indent=2) if arguments.json else '\n'.join(lines_from(about)))
    return 0


def _sides(arguments: argparse.Namespace) -> list[Side]:
    """Return both fields; a bag of another recorder is learnt like the other one."""
    names = arguments.first, arguments.second
    external = [Path(name).suffix != '.npz' and Path(name).exists() and is_external(Path(name))
              for name in names]
    option = wanted_option(arguments)
    if option and not any(external):
        raise UserError(f'{option}: says how a bag of another recorder is to be read, and neither '
                        f'{names[0]} nor {names[1]} is one')
    sides = [None if is_theirs else side_from(name, arguments.bags)
             for name, is_theirs in zip(names, external, strict=True)]
    own = next((side for side in sides if side is not None), None)
    return [side or _external_side(arguments, name, own)
            for name, side in zip(names, sides, strict=True)]


def _external_side(arguments: argparse.Namespace, name: str, other: Side | None) -> Side:
    """Return what a bag of another recorder teaches alone, in the workspace of the other field."""
    values = vars(arguments) | {'field': other}
    if arguments.like is not None:
        values['like'] = named_path(arguments.like, arguments.bags)
    with borrowed(argparse.Namespace(**values), Path(name)) as episode:
        return side_from_bags(name, [episode])


def lines_from(about: dict[str, Any]) -> list[str]:
    """Return the text for a person."""
    first, second = about['first'], about['second']
    rows: list[tuple[str, ...]] = [('', first['name'], second['name'])]
    for key, title in (('revision', 'episodes learnt'), ('prototypes', 'prototypes'),
                       ('known_cells', 'cells seen')):
        rows.append((title, *('not saved' if side[key] is None else str(side[key])
                              for side in (first, second))))
    for key in ('basin', 'proven', 'fidelity'):
        rows.append((key, *('-' if side[key] is None else f'{side[key]:.1%}'
                            for side in (first, second))))
    rows.append(('sinks', str(len(first['sinks'])), str(len(second['sinks']))))
    rows.append(('goal', *('({:.2f}, {:.2f}) m'.format(*side['goal_place'])
                           for side in (first, second))))
    return [_plain(about), '', *table_lines(rows, (1, 2)), '', *_difference_lines(about),
            about['figure']]


def _plain(about: dict[str, Any]) -> str:
    """Say in a sentence whether the robot is taught otherwise."""
    n, total = about['courses_differ'], about['cells']
    if not total:
        return 'No place is in the workspaces of both.'
    if n == 0:
        return ('Both lead the robot the same way everywhere.' if not about['cells_of_one_only']
                else 'Both lead the robot the same way wherever both lead it.')
    goal = ' They lead to different goals.' if about['goal_moved'] else ''
    return f'They lead the robot another way in {n} of {total} places.{goal}'


def _difference_lines(about: dict[str, Any]) -> list[str]:
    changes = ', '.join(f'{len(cells)} {name}' for name, cells in about['prototypes'].items())
    n, total = about['courses_differ'], about['cells']
    angle, most = about['mean_angle_degrees'], about['largest_angle_degrees']
    turned = '' if angle is None else f', {angle:.1f} degrees in the mean, {most:.0f} at most'
    equal = ' (the vectors are equal)' if about['vectors_equal'] else turned
    alone = about['cells_of_one_only']
    only = f'workspace: {counted(alone, "cell")} of one of them only'
    every, unlike = counted(total + alone, 'cell'), about['remembered_map_differs']
    return [
        *([only] if alone else []),
        f'headings: {n} of {counted(total, "cell")} differ ({n / max(total, 1):.1%}){equal}',
        f'prototypes: {changes}',
        f'remembered map: {unlike} of {every} differ',
        f'Q-matrix: at most {about["largest_q_difference"]:.3g} apart']
