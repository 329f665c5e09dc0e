"""A robot's description: links, joints between them, and where each link is."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from experience_cli.errors import UserError
from experience_cli.robot.xml_tree import tree_from_xml
from msgs_bridge.sensing.laser_mount import Mount
from msgs_bridge.untrusted.files import read_bytes

Floats = npt.NDArray[np.float64]

#: So many links lie between a link and the root at most; a chain that is longer bites its tail.
_LONGEST: Final = 200
_XACRO: Final = (
    '{path}: is xacro that is not expanded yet: `xacro {path} > robot.urdf` (or `ros2 run xacro '
    'xacro {path} > robot.urdf`) does that, then give robot.urdf')


@dataclass(frozen=True, eq=False)
class Shape:
    """
    A body of a link.

    Parameters
    ----------
    kind : str
        ``box``, ``cylinder``, ``sphere``, ``capsule`` or ``mesh``.
    attributes : dict of str to str
        Of its element, as they stand there.
    place : ndarray, shape (4, 4)
        Where it is on its link.

    """

    kind: str
    attributes: dict[str, str]
    place: Floats


@dataclass(frozen=True, eq=False)
class Joint:
    """What holds a link on another one."""

    name: str
    kind: str
    parent: str
    child: str
    place: Floats
    axis: Floats
    #: Greatest speed, [rad/s] or [m/s]; None where it is not said.
    velocity: float | None


@dataclass(frozen=True, eq=False)
class Description:
    """
    A URDF.

    Parameters
    ----------
    path : Path
    name : str
    collisions, visuals : dict of str to list of Shape
        By link.
    joints : dict of str to Joint
        By the link that each holds.
    tree : Element
        All of it, for what simulators add.

    """

    path: Path
    name: str
    collisions: dict[str, list[Shape]]
    visuals: dict[str, list[Shape]]
    joints: dict[str, Joint]
    tree: Any = field(repr=False)

    @cached_property
    def root(self) -> str:
        """Return the link that no joint holds."""
        return next(link for link in self.collisions if link not in self.joints)

    def above(self, link: str) -> Iterator[Joint]:
        """Yield the joints that hold a link, the nearest first."""
        while link in self.joints:
            yield self.joints[link]
            link = self.joints[link].parent

    def place(self, link: str, seen_from: str) -> Floats:
        """Return where a link is, all joints at 0, as seen from another one, shape (4, 4)."""
        return np.linalg.inv(self._in_root(seen_from)) @ self._in_root(link)

    def _in_root(self, link: str) -> Floats:
        place = np.eye(4)
        for joint in self.above(link):
            place = joint.place @ place
        return place


def description_from_file(path: Path) -> Description:
    """
    Read a URDF.

    Raises
    ------
    UserError
        If it is none, or is xacro; one line that says so.
    OSError
        If it cannot be read.

    """
    tree = _tree(path)
    if tree.tag != 'robot':
        kind = 'SDF, a URDF is wanted' if tree.tag == 'sdf' else f'of <{tree.tag[:40]}>'
        raise UserError(f'{path}: is no URDF: its element is not <robot>; it is {kind}')
    links = [_named(path, link) for link in tree.findall('link')]
    if not links:
        raise UserError(f'{path}: has no <link>, so that there is no robot in it')
    twice = next((name for name in links if links.count(name) > 1), None)
    if twice is not None:
        raise UserError(f'{path}: has two links called {twice!r}')
    collisions, visuals = (
        {_named(path, link): list(_shapes(path, link, kind)) for link in tree.findall('link')}
        for kind in ('collision', 'visual'))
    found = Description(path, tree.get('name', ''), collisions, visuals,
                        _joints(path, tree, set(links)), tree)
    _check_tree(found)
    return found


def _tree(path: Path) -> Any:
    """Return the element of a URDF."""
    text = read_bytes(path)
    try:
        tree = tree_from_xml(text)
    except ValueError as error:
        if b'<xacro:' in text:
            raise UserError(_XACRO.format(path=path)) from None
        if b'ros__parameters' in text:
            raise UserError(f'{path}: is a parameter file: `experience robot from-nav2 {path}` '
                            f'reads it') from None
        raise UserError(f'{path}: {error}') from None
    if any(_is_xacro(element) for element in tree.iter()):
        raise UserError(_XACRO.format(path=path))
    return tree


def _is_xacro(element: Any) -> bool:
    words = [element.text or '', *element.attrib.values()]
    return 'xacro' in str(element.tag) or any('${' in word or '$(' in word for word in words)


def _named(path: Path, element: Any) -> str:
    name = element.get('name')
    if not name:
        raise UserError(f'{path}: a <{element.tag}> has no name')
    return str(name)


def _shapes(path: Path, link: Any, kind: str) -> Iterator[Shape]:
    for body in link.findall(kind):
        for shape in body.findall('geometry/*'):
            about = f'link {link.get("name")}, {kind}'
            yield Shape(str(shape.tag), dict(shape.attrib), _place(path, body, about))


def _joints(path: Path, tree: Any, links: set[str]) -> dict[str, Joint]:
    joints: dict[str, Joint] = {}
    for element in tree.findall('joint'):
        name = _named(path, element)
        parent, child = (_linked(path, element, end, links) for end in ('parent', 'child'))
        if child in joints:
            raise UserError(f'{path}: link {child!r} hangs on two joints, {joints[child].name!r} '
                            f'and {name!r}')
        limit, axis = element.find('limit'), element.find('axis')
        about = f'joint {name}'
        joints[child] = Joint(
            name, element.get('type', ''), parent, child, _place(path, element, about),
            np.array([1.0, 0.0, 0.0]) if axis is None
            else numbers(path, about, axis, 'xyz', '1 0 0'),
            None if limit is None or 'velocity' not in limit.attrib
            else float(numbers(path, about, limit, 'velocity', '0', 1)[0]))
    return joints


def _linked(path: Path, joint: Any, end: str, links: set[str]) -> str:
    element = joint.find(end)
    link = None if element is None else element.get('link')
    if link not in links:
        raise UserError(f'{path}: joint {joint.get("name")!r} has the {end} {link!r}, and there '
                        f'is no such link')
    return str(link)


def _place(path: Path, element: Any, about: str) -> Floats:
    """Return the transform of the origin of an element, shape (4, 4)."""
    origin, place = element.find('origin'), np.eye(4)
    if origin is not None:
        x, y, z = numbers(path, about, origin, 'xyz', '0 0 0')
        roll, pitch, yaw = numbers(path, about, origin, 'rpy', '0 0 0')
        place[:3, :3] = Mount(yaw=yaw, roll=roll, pitch=pitch).rotation
        place[:3, 3] = x, y, z
    return place


def numbers(
    path: Path, about: str, element: Any, name: str, default: str, n: int = 3,
) -> Floats:
    """Return the numbers of an attribute; a UserError where they are none."""
    return numbers_in(path, about, name, element.get(name, default), n)


def numbers_in(path: Path, about: str, name: str, text: str, n: int) -> Floats:
    """Return so many numbers of a text; a UserError where they are none."""
    try:
        values = np.array([float(word) for word in text.split()], dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    if len(values) != n or not np.isfinite(values).all() or np.abs(values).max() > 1e6:
        raise UserError(f'{path}: {about}: {name}={text[:60]!r} must be {n} numbers')
    return values


def _check_tree(found: Description) -> None:
    roots = [link for link in found.collisions if link not in found.joints]
    if not roots:
        raise UserError(f'{found.path}: its joints go round in a circle')
    if len(roots) > 1:
        raise UserError(f'{found.path}: nothing joins {roots[1]!r} to {roots[0]!r}: every link '
                        f'but one needs a joint that holds it')
    for link in found.joints:
        for n, _ in enumerate(found.above(link)):
            if n > _LONGEST:
                raise UserError(f'{found.path}: the joints above {link!r} go round in a circle, '
                                f'or are more than {_LONGEST}')
