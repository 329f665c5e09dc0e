"""A body that is no disc: a polygon on the floor, as Nav2's costmaps take it."""

from dataclasses import dataclass
from functools import lru_cache
import math
import re
from typing import Final

#: A point of the body, x ahead and y to the left of the robot's middle, [m].
Point = tuple[float, float]

#: So many corners a body has at most, and so far they may be from its middle, [m].
_MOST_CORNERS, _FARTHEST = 64, 10.0
_NUMBER: Final = r'\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*'
_POINT: Final = rf'\s*\[({_NUMBER}),({_NUMBER})\]\s*'
_FORM: Final = re.compile(rf'\s*\[{_POINT}(?:,{_POINT})*\]\s*')
_EXAMPLE: Final = '[[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]'


@dataclass(frozen=True, slots=True)
class Convex:
    """
    A convex polygon.

    Parameters
    ----------
    corners : tuple of (x, y), [m]
        Counter-clockwise.
    sides : tuple of (nx, ny, d)
        Outward unit normal of each side, and its distance from the robot's middle, [m].

    """

    corners: tuple[Point, ...]
    sides: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class Footprint:
    """
    The outline of a robot on the floor.

    Parameters
    ----------
    corners : tuple of (x, y), [m]
        Counter-clockwise; no side crosses another.
    pieces : tuple of Convex
        Convex polygons that together are the same.

    """

    corners: tuple[Point, ...]
    pieces: tuple[Convex, ...]

    @property
    def circumscribed(self) -> float:
        """Return the radius of the least disc about the robot's middle that holds it, [m]."""
        return max(math.hypot(*corner) for corner in self.corners)

    @property
    def inscribed(self) -> float:
        """Return the radius of the greatest disc about the robot's middle in it; 0 if none."""
        if not self.holds(0.0, 0.0):
            return 0.0
        return min(_distance_to_line(first, second) for first, second in _sides(self.corners))

    def holds(self, x: float, y: float) -> bool:
        """Return whether a point of the robot's frame lies on it, [m]."""
        return any(all(nx * x + ny * y <= d for nx, ny, d in piece.sides) for piece in self.pieces)


@lru_cache(8)
def footprint_from_text(text: str) -> Footprint | None:
    """
    Return the footprint that a parameter says; None where it is empty.

    Parameters
    ----------
    text : str
        ``[[x, y], ...]`` in metres, as Nav2 writes it, in either sense of rotation.

    Raises
    ------
    ValueError
        If it is none, has no area, or its sides cross; one line that says so.

    """
    if not text.strip():
        return None
    shown = text if len(text) <= 80 else f'{text[:80]}...'
    if not _FORM.fullmatch(text):
        raise ValueError(f'footprint is {shown!r}, must be at least three points such as '
                         f'{_EXAMPLE}, [m], or empty')
    points = [(float(x), float(y)) for x, y in re.findall(_POINT, text)]
    try:
        return footprint_from_points(points)
    except ValueError as error:
        raise ValueError(f'footprint is {shown!r}: {error}') from None


def footprint_from_points(points: list[Point]) -> Footprint:
    """
    Return the footprint with these corners, in order, [m].

    Raises
    ------
    ValueError
        If they are no outline.

    """
    corners = [point for point, before in zip(points, points[-1:] + points[:-1], strict=True)
               if point != before]
    if not 3 <= len(corners) <= _MOST_CORNERS:
        raise ValueError(f'it has {len(corners)} corners, must have 3 to {_MOST_CORNERS}')
    if max(abs(value) for corner in corners for value in corner) > _FARTHEST:
        raise ValueError(f'a corner is farther than {_FARTHEST:g} m from the middle of the robot; '
                         f'is it in metres?')
    if _crosses_itself(corners):
        raise ValueError('its sides cross or touch each other')
    area = _doubled_area(corners)
    if abs(area) < 1e-6:
        raise ValueError('it has no area')
    if area < 0.0:
        corners.reverse()
    return Footprint(tuple(corners), tuple(_convex(piece) for piece in _convex_pieces(corners)))


def text_from_points(points: tuple[Point, ...]) -> str:
    """Return corners as the parameter takes them."""
    return '[' + ', '.join(f'[{x:g}, {y:g}]' for x, y in points) + ']'


def _sides(corners: tuple[Point, ...] | list[Point]) -> list[tuple[Point, Point]]:
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))


def _convex(corners: list[Point]) -> Convex:
    sides = []
    for (ax, ay), (bx, by) in _sides(corners):
        length = math.hypot(bx - ax, by - ay)
        nx, ny = (by - ay) / length, (ax - bx) / length
        sides.append((nx, ny, max(nx * ax + ny * ay, nx * bx + ny * by)))
    return Convex(tuple(corners), tuple(sides))


def _doubled_area(corners: list[Point]) -> float:
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in _sides(corners))


def _turn(a: Point, b: Point, c: Point) -> float:
    """Return twice the area of a triangle; negative where it is clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _distance_to_line(a: Point, b: Point) -> float:
    """Return the distance of the origin from a side, [m]."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    share = min(max(-(a[0] * dx + a[1] * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return math.hypot(a[0] + share * dx, a[1] + share * dy)


def _crosses_itself(corners: list[Point]) -> bool:
    """Return whether two sides have a point in common that is no corner between them."""
    sides, n = _sides(corners), len(corners)
    if any(_turns_back(corners[i - 1], corners[i], corners[(i + 1) % n]) for i in range(n)):
        return True
    return any(_meet(*sides[i], *sides[j]) for i in range(n) for j in range(i + 2, n)
               if (i, j) != (0, n - 1))


def _turns_back(a: Point, b: Point, c: Point) -> bool:
    """Return whether the way from one corner to the next leads straight back after it."""
    ahead = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1])
    return ahead < 0.0 and abs(_turn(a, b, c)) < 1e-9


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    if _turn(a, b, c) * _turn(a, b, d) > 0.0 or _turn(c, d, a) * _turn(c, d, b) > 0.0:
        return False
    return all(max(a[i], b[i]) >= min(c[i], d[i]) and max(c[i], d[i]) >= min(a[i], b[i])
               for i in (0, 1))


def _convex_pieces(corners: list[Point]) -> list[list[Point]]:
    """Return convex polygons that make up one that is counter-clockwise: itself, or triangles."""
    n = len(corners)
    if all(_turn(corners[i - 1], corners[i], corners[(i + 1) % n]) >= 0.0 for i in range(n)):
        return [corners]
    left, pieces = list(corners), []
    while len(left) > 3:
        index = next((i for i in range(len(left)) if _can_be_cut(left, i)), None)
        if index is None:
            raise ValueError('its corners lie on one line, or nearly')
        pieces.append([left[index - 1], left[index], left[(index + 1) % len(left)]])
        del left[index]
    return [piece for piece in [*pieces, left] if _turn(*piece) > 0.0]


def _can_be_cut(corners: list[Point], i: int) -> bool:
    """Return whether a corner can be cut off: no other corner lies in its triangle."""
    a, b, c = corners[i - 1], corners[i], corners[(i + 1) % len(corners)]
    if _turn(a, b, c) < 0.0:
        return False
    return not any(
        _turn(a, b, p) >= 0.0 and _turn(b, c, p) >= 0.0 and _turn(c, a, p) >= 0.0
        for p in corners if p not in (a, b, c))
