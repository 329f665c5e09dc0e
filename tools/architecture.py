"""
Draw the picture of doc/architecture.md from the imports and the layers that import-linter holds.

`python tools/architecture.py` writes doc/architecture.svg; with `--check` it only says whether the
picture is true. A box is a package, a bar in it a package inside; an arrow says that modules of
the upper one import modules of the lower one, and how often.
"""

import ast
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
import math
from pathlib import Path
import sys
import tomllib
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / 'doc' / 'architecture.svg'

# What a box says below its name, where it stands from left to right, and its colour.
ROOMS = {
    'experience_cli': ('the command line: experience learn, list, explain, evaluate, demo ...',
                       0, 1190, '#7b5ea7'),
    'experience_evaluation': ('how good is it,\non any world?', 0, 150, '#3d8f8a'),
    'sim_node': ('a simulated\nrobot', 158, 88, '#3f74b5'),
    'neighbourhood_node': ('scan or costmap\nto local grid', 254, 146, '#3f74b5'),
    'localised_odometry_node': ("odometry in\na map's frame", 408, 140, '#3f74b5'),
    'teleop_node': ('keys to drive\nand to teach', 556, 100, '#3f74b5'),
    'page_node': ('a page to drive\nand to teach', 664, 134, '#3f74b5'),
    'control_field_node': ('the controller:\nodom to cmd_vel', 806, 138, '#3f74b5'),
    'learner_node': ('records drives and trials,\nlearns between them', 952, 238, '#3f74b5'),
    'world_maps': ('map_server, MovingAI', 78, 650, '#6d9442'),
    'episode_store': ("the robot's memory:\ntasks, episodes, relearning", 740, 396, '#c9762b'),
    'msgs_bridge': ('between ROS 2 and the core', 0, 1190, '#64748b'),
    'control_field': ('the paper, in NumPy: no ROS, no files, no clock', 0, 1190, '#b8901f'),
}
INNER = {
    'experience_cli.commands': 'a module a command, imported when it is called',
    'experience_cli.figures': 'fields, maps, paths and learning, drawn',
    'experience_cli.demo': 'real nodes, taught and tried',
    'experience_cli.robot': 'URDF and Nav2 read',
    'experience_evaluation.methods': '',
    'episode_store.external': "others' bags",
    'episode_store.rosbag2': '',
    'control_field_node.driving': '',
    'control_field_node.commands': '',
    'control_field_node.inputs': '',
    'page_node.server': '',
    'page_node.driving': '',
    'page_node.actions': '',
    'page_node.memory': '',
    'page_node.story': '',
    'page_node.view': '',
    'page_node.worlds': '',
    'learner_node.learning': 'in a thread aside',
    'learner_node.recording': 'into bags',
    'learner_node.session': 'what it is at',
    'msgs_bridge.teaching': 'what keys and page share: actions, clients, status',
    'msgs_bridge.node': 'what every node shares: run, parameters, QoS, logs, peers',
    'msgs_bridge.sensing': 'scans and costmaps to local grids',
    'msgs_bridge.messages': 'message from and to core type',
    'msgs_bridge.untrusted': 'files and text that are not ours',
    'control_field.learning': 'episodes in, control field and certificate out',
    'control_field.robot': 'policy, steering, collision monitor, stop rules, particle filter',
    'control_field.drives': 'what may be learnt of a drive',
    'control_field.kernels': 'loops written once, run in plain Python on the robot and compiled '
                             'where it learns',
}
#: Libraries that are heavy, or that few may import.
LIBRARIES = ('rclpy', 'numba', 'mcap', 'rosbags', 'matplotlib', 'PIL')
MARGIN, GAP, BAR, LINE = 16, 66, 30, 18


class Import(NamedTuple):
    """A module that imports another one."""

    source: str
    target: str


def imports(folder: str) -> Iterator[Import]:
    """Yield which module of a package imports which module, each pair once."""
    found = set()
    for path in sorted((ROOT / folder).rglob('*.py')):
        source = '.'.join(path.relative_to(ROOT).with_suffix('').parts)
        for node in ast.walk(ast.parse(path.read_text())):
            found |= {Import(source, target) for target in _targets(node)}
    yield from sorted(found)


def _targets(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and node.module:
        for alias in node.names:
            whole = f'{node.module}.{alias.name}'
            is_module = (ROOT / f'{whole.replace(".", "/")}.py').is_file()
            yield whole if is_module else node.module


def room_of(module: str) -> str:
    """Return the package inside a package, or the package, that a module belongs to."""
    inner = '.'.join(module.split('.')[:2])
    return inner if (ROOT / inner.replace('.', '/')).is_dir() else module.split('.')[0]


@dataclass(frozen=True)
class Layers:
    """What the contracts of import-linter say: from the top to the bottom."""

    rooms: list[list[str]]
    inner: dict[str, list[list[str]]]
    """The same for each room that has packages inside."""


def read_layers() -> Layers:
    """Read the contracts; what no contract names comes last."""
    contracts = tomllib.loads((ROOT / 'pyproject.toml').read_text())['tool']['importlinter']
    layers = [c for c in contracts['contracts'] if c['type'] == 'layers']
    rooms = next(_split(c['layers']) for c in layers if 'containers' not in c)
    named = {c['containers'][0]: _split(c['layers']) for c in layers if 'containers' in c}
    inner = {}
    for room in ROOMS:
        there = [path.parent.name for path in sorted((ROOT / room).glob('*/__init__.py'))]
        rows = [[name for name in row if name in there] for row in named.get(room, [])]
        said = {name for row in rows for name in row}
        rows += [[name] for name in there if name not in said]
        inner[room] = [row for row in rows if row]
    return Layers(rooms, inner)


def _split(layers: list[str]) -> list[list[str]]:
    return [[name.strip() for name in layer.split('|')] for layer in layers]


@dataclass(frozen=True)
class Box:
    """Where a room is drawn."""

    x: int
    y: int
    width: int
    height: int
    colour: str


def place(layers: Layers) -> dict[str, Box]:
    """Return a box for each room, layer below layer."""
    boxes, y = {}, MARGIN
    for row in layers.rooms:
        for room in row:
            _, x, width, colour = ROOMS[room]
            height = LINE * n_lines(room) + (BAR + 5) * (len(layers.inner[room]) or 1) + 15
            boxes[room] = Box(x + MARGIN, y, width, height, colour)
        y += max(boxes[room].height for room in row) + GAP
    return boxes


def title(room: str) -> list[str]:
    """Return the name of a room, in two lines where its box is too narrow."""
    fits = (ROOMS[room][2] - 20) // 9
    if len(room) <= fits:
        return [room]
    cut = room.rindex('_', 0, fits) + 1
    return [room[:cut], room[cut:]]


def n_lines(room: str) -> int:
    """Return how many lines of text a room begins with."""
    return len(title(room)) + len(ROOMS[room][0].splitlines())


def lanes(edges: Sequence[Import], boxes: dict[str, Box]) -> dict[Import, int]:
    """
    Choose for each arrow where it goes straight down.

    It keeps clear of the boxes between its ends, but for the bridge, behind which it passes, and
    as far as it can from the other arrows; those with the least choice come first.
    """
    choices = {edge: _free(edge, boxes) for edge in edges}
    chosen: dict[Import, int] = {}
    for edge in sorted(edges, key=lambda edge: (len(choices[edge]), edge)):
        middle = boxes[edge.source].x + boxes[edge.source].width // 2
        chosen[edge] = max(choices[edge], key=lambda x: (
            min([44, *(abs(x - other) for other in chosen.values())]), -abs(x - middle)))
    return chosen


def _free(edge: Import, boxes: dict[str, Box]) -> list[int]:
    above, below = boxes[edge.source], boxes[edge.target]
    between = [box for room, box in boxes.items()
               if above.y < box.y < below.y and room != 'msgs_bridge']
    first = max(above.x, below.x) + 14
    last = min(above.x + above.width, below.x + below.width) - 14
    free = [x for x in range(first, last + 1)
            if all(not box.x - 9 < x < box.x + box.width + 9 for box in between)]
    return free or list(range(first, last + 1))


def arrow(x: int, edge: Import, count: int, boxes: dict[str, Box]) -> str:
    """Return an arrow from the bottom of a box to the top of another one, and its count."""
    above, below = boxes[edge.source], boxes[edge.target]
    top, tip, colour = above.y + above.height, below.y - 2, below.colour
    width = 1.2 + 0.55 * math.log2(count)
    half = 4.5 + width / 2
    wide = 9 + 7 * len(str(count))
    return '\n'.join([
        f'<path d="M{x} {top}V{tip - 9}" stroke="{colour}" stroke-width="{width:.1f}"/>',
        f'<path d="M{x} {tip}l{-half:.1f} -11h{2 * half:.1f}z" fill="{colour}"/>',
        _rectangle(Box(x - wide // 2, top + 10, wide, 18, colour), 9, '#fff', colour),
        _text('n', x, top + 23, str(count))])


def drawn_box(room: str, box: Box, rows: list[list[str]], counts: Counter[str]) -> str:
    """Return a room: its name, what it is, and the packages in it."""
    lines = [('t', line) for line in title(room)]
    lines += [('s', line) for line in ROOMS[room][0].splitlines()]
    parts = [
        _rectangle(box, 9, _tint(box.colour, 0.86), box.colour),
        *(_text(kind, box.x + 10, box.y + 21 + LINE * i, line)
          for i, (kind, line) in enumerate(lines)),
        _libraries(room, box, box.y + (21 if rows else box.height - 10), counts),
    ]
    y = box.y + LINE * len(lines) + 14
    for row in rows:
        width = (box.width - 16 - 6 * (len(row) - 1)) // len(row)
        for i, name in enumerate(row):
            bar = Box(box.x + 8 + i * (width + 6), y, width, BAR, box.colour)
            parts.append(_bar(f'{room}.{name}', bar, counts))
        y += BAR + 5
    return '\n'.join(parts)


def _bar(inner: str, bar: Box, counts: Counter[str]) -> str:
    name = inner.split('.')[1]
    fill = _tint(bar.colour, 0.66)
    return '\n'.join([
        _rectangle(bar, 5, fill, fill),
        _text('b', bar.x + 9, bar.y + 20, name, INNER[inner]),
        _libraries(inner, bar, bar.y + 20, counts)])


def _libraries(room: str, box: Box, y: int, counts: Counter[str]) -> str:
    names = [name for name in LIBRARIES if counts[f'{room} {name}']]
    return _text('l', box.x + box.width - 9, y, ' · '.join(names))


def _rectangle(box: Box, radius: int, fill: str, stroke: str) -> str:
    return (f'<rect x="{box.x}" y="{box.y}" width="{box.width}" height="{box.height}" '
            f'rx="{radius}" fill="{fill}" stroke="{stroke}"/>')


def _text(kind: str, x: int, y: int, text: str, more: str = '') -> str:
    """Return a line of text of a class of `HEAD`, if there is any, and more of it in small."""
    small = f'<tspan class="s" dx="9">{escape(more)}</tspan>' if more else ''
    return f'<text class="{kind}" x="{x}" y="{y}">{escape(text)}{small}</text>' if text else ''


def _tint(colour: str, share: float) -> str:
    """Mix a colour with this share of white."""
    parts = (int(colour[i:i + 2], 16) for i in (1, 3, 5))
    return '#' + ''.join(f'{round(part + (255 - part) * share):02x}' for part in parts)


def picture() -> str:
    """Return the picture as SVG."""
    layers = read_layers()
    boxes = place(layers)
    found = [pair for room in ROOMS for pair in imports(room)]
    counts = Counter(f'{room_of(source)} {target.split(".")[0]}' for source, target in found)
    between = Counter(Import(a.split('.')[0], b.split('.')[0]) for a, b in found)
    edges = sorted(edge for edge in between
                   if edge.source != edge.target and edge.target in boxes)
    width = 2 * MARGIN + max(x + wide for _, x, wide, _ in ROOMS.values())
    height = MARGIN + max(box.y + box.height for box in boxes.values())
    where = lanes(edges, boxes)
    parts = [arrow(where[edge], edge, between[edge], boxes) for edge in edges]
    parts += [drawn_box(room, box, layers.inner[room], counts) for room, box in boxes.items()]
    return HEAD.format(width=width, height=height) + '\n'.join(parts) + '\n</svg>\n'


HEAD = """\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"
 font-family="Helvetica, Arial, DejaVu Sans, sans-serif">
<style>
.t {{ font-size: 15px; font-weight: bold; fill: #1e293b }}
.b {{ font-size: 14px; font-weight: bold; fill: #1e293b }}
.s {{ font-size: 13px; font-weight: normal; fill: #475569 }}
.l {{ font-size: 12px; font-style: italic; fill: #64748b; text-anchor: end }}
.n {{ font-size: 12px; font-weight: bold; fill: #334155; text-anchor: middle }}
</style>
<rect width="{width}" height="{height}" fill="#fff"/>
"""


def main() -> int:
    """Write the picture, or say whether it is true."""
    if '--check' not in sys.argv[1:]:
        PICTURE.write_text(picture())
        return 0
    if PICTURE.exists() and PICTURE.read_text() == picture():
        return 0
    print(f'doc/{PICTURE.name} is not what the code says: run python tools/architecture.py',
          file=sys.stderr)
    return 1


if __name__ == '__main__':
    sys.exit(main())
