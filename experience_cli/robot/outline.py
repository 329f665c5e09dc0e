"""The outline of a robot on the floor: what its bodies cover, seen from above."""

from collections.abc import Iterator
import math
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from control_field.robot.footprint import Point
from experience_cli.robot.meshes import mesh_file, vertices_from_mesh
from experience_cli.robot.urdf import Description, Floats, numbers_in, Shape

#: Corners of the polygon around a circle, and most corners of an outline.
_N_RING: Final = 32
_MOST_CORNERS: Final = 16
#: An outline whose corners lie no farther out than its sides, times this, is called a disc.
_ROUND: Final = 1.15


class Outline(NamedTuple):
    """
    What a robot covers.

    Parameters
    ----------
    corners : tuple of (x, y), [m]
        Convex, counter-clockwise, about the robot's middle.
    source : str
        What it was made from.
    notes : list of str
        What of it is not known.
    reach : float, [m]
        How far it reaches from the middle.
    is_round : bool
        Whether a disc about the middle is as good.

    """

    corners: tuple[Point, ...]
    source: str
    notes: list[str]
    reach: float = 0.0
    is_round: bool = False


def outline_of(robot: Description, base: str, folders: list[Path]) -> Outline | None:
    """
    Return the convex hull of a robot's bodies, as seen from above; None where there are none.

    Parameters
    ----------
    robot : Description
    base : str
        The link that the robot's middle is.
    folders : list of Path
        Where packages are, for meshes.

    """
    notes: list[str] = []
    for kind, shapes in (('collision', robot.collisions), ('visual', robot.visuals)):
        points, used = [], []
        for link, bodies in shapes.items():
            place = robot.place(link, base)
            found = list(_bodies(robot, link, bodies, place, folders, notes))
            points.extend(found)
            used.extend([link] * bool(found))
        hull = _hull(points)
        if len(hull) >= 3:
            notes.extend(_moving(robot, used))
            reach = max(math.hypot(*corner) for corner in hull)
            return Outline(tuple(_rounded(_simplified(hull))), _source(kind, used), notes,
                           _up(reach), reach <= _ROUND * _inscribed(hull))
    return Outline((), '', notes) if notes else None


def _bodies(
    robot: Description, link: str, bodies: list[Shape], place: Floats, folders: list[Path],
    notes: list[str],
) -> Iterator[Floats]:
    """Yield the points that the bodies of a link cover, shape (n, 2), [m]."""
    for body in bodies:
        try:
            yield _points(robot, link, body, place @ body.place, folders)
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else str(error)
            note = f'{link}: {body.attributes.get("filename", body.kind)} is left out: {why}'
            if note not in notes:
                notes.append(note)


def _points(
    robot: Description, link: str, body: Shape, place: Floats, folders: list[Path],
) -> Floats:
    def read(name: str, n: int = 1) -> Floats:
        return numbers_in(
            robot.path, f'link {link}, {body.kind}', name, body.attributes.get(name, ''), n)

    if body.kind == 'box':
        corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3), axis=-1).reshape(-1, 3)
        return _moved(place, corners * read('size', 3))
    if body.kind == 'sphere':
        return place[:2, 3] + _ring(float(read('radius')[0]))
    if body.kind in ('cylinder', 'capsule'):
        radius, half = float(read('radius')[0]), 0.5 * float(read('length')[0])
        if body.kind == 'capsule':
            ends = _moved(place, np.array([[0.0, 0.0, half], [0.0, 0.0, -half]]))
            return (ends[:, np.newaxis] + _ring(radius)).reshape(-1, 2)
        ring = np.pad(_ring(radius), ((0, 0), (0, 1)))
        return _moved(place, np.concatenate([ring + [0, 0, half], ring - [0, 0, half]]))
    if body.kind != 'mesh':
        raise ValueError('this kind of body is not known')
    scale = numbers_in(robot.path, f'link {link}, mesh', 'scale',
                       body.attributes.get('scale', '1 1 1'), 3)
    file = mesh_file(body.attributes.get('filename', ''), robot.path, folders)
    return _moved(place, vertices_from_mesh(file) * scale)


def _moved(place: Floats, points: Floats) -> Floats:
    moved: Floats = (points @ place[:3, :3].T + place[:3, 3])[:, :2]
    return moved


def _ring(radius: float) -> Floats:
    """Return the corners of a polygon around a circle."""
    angles = np.arange(_N_RING) * (math.tau / _N_RING)
    around = radius / math.cos(math.pi / _N_RING)
    return around * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _hull(points: list[Floats]) -> list[Point]:
    return convex_hull([(float(x), float(y)) for each in points for x, y in each])


def _inscribed(hull: list[Point]) -> float:
    """Return how near a side is to the middle, [m]; 0 or less where that lies outside."""
    return min((a[0] * b[1] - b[0] * a[1]) / math.dist(a, b)
               for a, b in zip(hull, [*hull[1:], hull[0]], strict=True))


def _simplified(hull: list[Point]) -> list[Point]:
    """Return a polygon of few corners around one of many, as narrow as may be."""
    if len(hull) <= _MOST_CORNERS:
        return hull
    angles = np.arange(_MOST_CORNERS) * (math.tau / _MOST_CORNERS)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    reach = (np.array(hull) @ normals.T).max(axis=0)
    corners = [np.linalg.solve(normals[[i - 1, i]], reach[[i - 1, i]])
               for i in range(_MOST_CORNERS)]
    return convex_hull([(float(x), float(y)) for x, y in corners])


def convex_hull(points: list[Point]) -> list[Point]:
    """Return the corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(set(points))

    def chain(points: list[Point]) -> list[Point]:
        found: list[Point] = []
        for p in points:
            while len(found) > 1 and (
                    (found[-1][0] - found[-2][0]) * (p[1] - found[-2][1])
                    - (found[-1][1] - found[-2][1]) * (p[0] - found[-2][0])) <= 1e-12:
                found.pop()
            found.append(p)
        return found[:-1]

    return chain(ordered) + chain(ordered[::-1])


def _rounded(hull: list[Point]) -> list[Point]:
    """Return corners in whole millimetres, away from the middle."""
    return convex_hull([
        (math.copysign(_up(abs(x)), x), math.copysign(_up(abs(y)), y)) for x, y in hull])


def _up(length: float) -> float:
    return math.ceil(length * 1000.0 - 1e-6) / 1000.0


def _moving(robot: Description, links: list[str]) -> list[str]:
    """Say which joints move what the outline is made of, other than wheels that only roll."""
    moving = sorted({joint.name for link in links for joint in robot.above(link)
                     if joint.kind in ('revolute', 'prismatic', 'floating', 'planar')})
    if not moving:
        return []
    shown = ', '.join(moving[:5]) + (' and others' if len(moving) > 5 else '')
    return [f'the outline is that with {shown} at 0: what they move out of it is not in it']


def _source(kind: str, links: list[str]) -> str:
    shown = ', '.join(dict.fromkeys(links[:6])) + (f' and {len(links) - 6} more' if len(
        links) > 6 else '')
    return f'{kind} geometry of {shown}'
