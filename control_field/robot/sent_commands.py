"""
What was sent to the wheels lately: it brings a pose of a moment ago up to now.

Times are seconds of one clock, the caller's.
"""

from collections import deque
from collections.abc import Iterable
import math

from control_field.robot.limits import STANDSTILL, Velocity

#: A place on the floor: x, y [m] and yaw [rad].
Place = tuple[float, float, float]
#: Speed [m/s], turning rate [rad/s] and for how long [s].
Piece = tuple[float, float, float]


def moved(place: Place, piece: Piece) -> Place:
    """Return where an arc ends that begins at a place."""
    x, y, yaw = place
    v, w, seconds = piece
    half = 0.5 * w * seconds
    chord = v * seconds if abs(half) < 1e-9 else v * seconds * math.sin(half) / half
    return (x + chord * math.cos(yaw + half), y + chord * math.sin(yaw + half), yaw + 2.0 * half)


def moved_along(place: Place, pieces: Iterable[Piece]) -> Place:
    """Return where one arc after the other leads to."""
    for piece in pieces:
        place = moved(place, piece)
    return place


class SentCommands:
    """
    The commands of the last seconds.

    Parameters
    ----------
    keep : float, [s]
        How long a command is remembered after the next one.

    """

    def __init__(self, keep: float = 4.0) -> None:
        """Start with a robot that stands."""
        self._keep = keep
        self._sent: deque[tuple[float, Velocity]] = deque()

    @property
    def newest(self) -> Velocity:
        """Return the command that holds now."""
        return self._sent[-1][1] if self._sent else STANDSTILL

    @property
    def changed_at(self) -> float:
        """Return when the newest one was sent first; minus infinity where there is none."""
        return self._sent[-1][0] if self._sent else -math.inf

    def note(self, at: float, velocity: Velocity) -> None:
        """Note a command; the same one again is nothing new."""
        if self._sent and at < self._sent[-1][0]:  # the clock was set: what was before is unknown
            self._sent.clear()
        if velocity != self.newest:
            self._sent.append((at, velocity))
        while len(self._sent) > 1 and self._sent[1][0] < at - self._keep:
            self._sent.popleft()

    def pieces(self, since: float, until: float) -> list[Piece]:
        """Return what was driven by between two times, in order; nothing where it stood only."""
        found: list[Piece] = []
        end = until
        for at, (v, w) in reversed(self._sent):
            if end <= since:
                break
            if at < end:
                start = at if at > since else since
                found.append((v, w, end - start))
                end = start
        found.reverse()
        return found if any(v or w for v, w, _ in found) else []

    def motion(self, since: float, until: float) -> tuple[float, float]:
        """Return how far forward [m] and around [rad] was sent between two times."""
        pieces = self.pieces(since, until)
        return sum(v * seconds for v, _, seconds in pieces), sum(
            w * seconds for _, w, seconds in pieces)

    def at(self, when: float) -> Velocity:
        """Return the command that held at a time."""
        return next((velocity for at, velocity in reversed(self._sent) if at <= when), STANDSTILL)

    def stood_since(self, until: float) -> float:
        """Return for how long nothing but standstill was sent before a time, [s]."""
        end = until
        for at, velocity in reversed(self._sent):
            if velocity != STANDSTILL:
                return until - min(end, until)
            end = at
        return math.inf

    def time_of(self, since: float, way: float, turn: float) -> float | None:
        """Return when what is sent from a time on makes so much way [m] or turn [rad]."""
        at, gone, turned = since, 0.0, 0.0
        for v, w, seconds in self.pieces(since, math.inf if self.newest != STANDSTILL else (
                self.changed_at)):
            needed = min((way - gone) / abs(v) if v else math.inf,
                         (turn - turned) / abs(w) if w else math.inf)
            if needed <= seconds:
                return at + needed
            at, gone, turned = at + seconds, gone + abs(v) * seconds, turned + abs(w) * seconds
        return None
