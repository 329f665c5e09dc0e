"""
Write the parameter tables of doc/parameters.md from the dataclasses that declare them.

`python tools/parameter_tables.py` writes; with `--check` it only says whether they are true.
"""

from dataclasses import Field, fields
import math
from pathlib import Path
import sys
from typing import Any

from control_field.parameters import Parameters
from control_field_node.settings import DECISION_PARAMETERS
from control_field_node.settings import FIXED as CONTROLLER_FIXED
from control_field_node.settings import Settings as ControllerSettings
from learner_node.settings import FIXED as LEARNER_FIXED
from learner_node.settings import Settings as LearnerSettings
from localised_odometry_node.fusion import FIXED as LOCALISED_FIXED
from localised_odometry_node.fusion import LocalisedSettings
from neighbourhood_node.settings import FIXED as NEIGHBOURHOOD_FIXED
from neighbourhood_node.settings import NeighbourhoodSettings
from page_node.settings import FIXED as PAGE_FIXED
from page_node.settings import Settings as PageSettings
from sim_node.settings import FIXED as SIM_FIXED
from sim_node.settings import SimSettings
from teleop_node.settings import FIXED as TELEOP_FIXED
from teleop_node.settings import Settings as TeleopSettings

#: A range of fewer whole numbers is looked at one by one.
_FEW = 10
PAGE = Path(__file__).resolve().parents[1] / 'doc' / 'parameters.md'

INTRODUCTION = """# Parameters

Written by `python tools/parameter_tables.py` from the declarations in the code; `make check`
keeps it current. A value out of range is refused, at start with exit code 2 and at run time with
a message that names the range. *Fixed* parameters cannot be changed at run time.

Set them with `--ros-args -p NAME:=VALUE` or `--params-file FILE`; `--help` of a node lists its
names. A name that is almost one of the node's is refused with exit code 2 and a suggestion, if
it was given to this node: by `-p`, or in a section of the file that names the node; otherwise a
misspelt limit would have no effect. A name that is like none of the node's own is ignored with a
warning. A section for any node (`/**`) may hold names of others; a name in it that is almost one
of this node's gets a warning.

ROS silently drops a section for another node, or a whole file: `control_field_node:` matches no
node in a namespace. So a file without a section for the node that it is given to is refused,
with the names of its sections and what to call them; so is a section that was meant for the node
but does not match it. `/**/control_field_node` matches that node in every namespace. A file that
several nodes share has a section for each of them, or one for all (`/**`).

Remappings (`-r FROM:=TO`) that change nothing are named in a warning, with the topic that may
have been meant; those of other nodes' topics, which a launch file passes to all, in a note.
"""


def limits_of(spec: 'Field[Any]', kind: Any) -> str:
    """Return the range or the choices of a parameter of a dataclass."""
    meta = spec.metadata
    if meta['choices']:
        return ', '.join(f'`{choice}`' for choice in meta['choices'])
    low, high = meta['low'], meta['high']
    if isinstance(spec.default, bool) or (math.isinf(low) and math.isinf(high)):
        return ''
    if isinstance(spec.default, int) and high - low < _FEW:
        values = range(int(low), int(high) + 1)
        taken = [value for value in values if _takes(kind, spec.name, value)]
        if len(taken) < len(values):
            return ' or '.join(map(str, taken))
    return f'{low:g} to {high:g}'


def _takes(kind: Any, name: str, value: int) -> bool:
    """Return True if a value is allowed together with the defaults."""
    try:
        kind(**{name: value})
    except ValueError:
        return False
    return True


def row_of(spec: 'Field[Any]', kind: Any, fixed: bool) -> str:
    """Return one line of a table."""
    default = str(spec.default).lower() if isinstance(spec.default, bool) else spec.default
    unit = '' if spec.metadata['unit'] == '1' else spec.metadata['unit']
    meaning = spec.metadata['meaning'] + (' (fixed)' if fixed else '')
    return f'| `{spec.name}` | `{default}` | {unit} | {limits_of(spec, kind)} | {meaning} |'


def table(title: str, note: str, kind: Any, fixed: tuple[str, ...] = ()) -> str:
    """Return a section: a heading, a note and a table of a dataclass."""
    rows = '\n'.join(row_of(spec, kind, spec.name in fixed) for spec in fields(kind))
    return (f'\n## {title}\n{note}\n\n| name | default | unit | range | meaning |\n'
            f'|---|---|---|---|---|\n{rows}\n')


def page() -> str:
    """Return the whole page."""
    deciding = ', '.join(f'`{name}`' for name in DECISION_PARAMETERS)
    return INTRODUCTION + ''.join([
        table('Learning', 'Of `learner_node`, `experience learn` and `experience evaluate --set`; '
              f'`control_field_node` has those that decisions depend on: {deciding}. Give both '
              'nodes the same. All are fixed on `learner_node`; on `control_field_node` they can '
              'be changed at run time, and hold from the next trial on.', Parameters),
        table('control_field_node', '', ControllerSettings, CONTROLLER_FIXED),
        table('learner_node', 'And `start_poses` (fixed): a flat list x, y, yaw, x, y, yaw, ... '
              'in metres and radians.', LearnerSettings, LEARNER_FIXED),
        table('sim_node', '', SimSettings, SIM_FIXED),
        table('neighbourhood_node', '', NeighbourhoodSettings, NEIGHBOURHOOD_FIXED),
        table('localised_odometry_node', '', LocalisedSettings, LOCALISED_FIXED),
        table('teleop_node', '', TeleopSettings, TELEOP_FIXED),
        table('page_node', '', PageSettings, PAGE_FIXED),
    ])


def main() -> int:
    """Write the page, or say whether it is true."""
    if '--check' not in sys.argv[1:]:
        PAGE.write_text(page())
        return 0
    if PAGE.exists() and PAGE.read_text() == page():
        return 0
    print(f'{PAGE.name} is not what the code says: run python tools/parameter_tables.py',
          file=sys.stderr)
    return 1


if __name__ == '__main__':
    sys.exit(main())
