"""
Whether the robot does what was sent to it: what a link that turns bad under way is known by.

A robot that drives one way all the time tells nothing of how late it hears. As soon as something
else is sent, it has to be seen within the time that was measured; where it is not, what was sent
since may still be on its way, and is executed late, from another place than it was meant for.
"""

from collections import deque
import math
from typing import Final

from control_field.robot.sent_commands import Place, SentCommands

#: Times over which a motion is looked at, [s]; poses farther apart than the last tell nothing.
_SPANS: Final = (0.09, 0.19, 0.39)
_APART: Final = 1.0
#: How much faster and slower than told a robot may be seen, as a share, and beyond that in a look,
#: [m] and [rad]: wheels slip, encoders are coarse, bodies are inert.
_FASTER, _SLOWER = 1.12, 0.7
_WAY, _TURN = 0.002, 0.02
#: What standing is seen as, [m] and [rad].
_STILL_WAY, _STILL_TURN = 0.001, 0.005
#: Delays that are looked for, [s]: in which steps, how much beside what was measured, at most.
_STEP: Final = 0.025
_BESIDE: Final = 0.05
_MOST: Final = 1.5
#: How long a delay is remembered, [s].
_REMEMBERED: Final = 20.0
#: How much longer than measured a command may take before nothing more is sent, [s].
_TOO_LONG: Final = 0.35
#: How long a robot stands until nothing that was sent before comes any more, [s].
_CALM: Final = 3.0


class Following:
    """
    Compares how the robot moves with what was sent.

    Attributes
    ----------
    is_lost : bool
        Whether what it does cannot be told from what was sent: it is to stand until it has stood.
    is_unanswered : bool
        Whether it stands although it was told to move, and should have been seen moving.
    confirmed : float, [s]
        What was sent before has been executed for certain, or never will be; what was sent since
        may still be on its way.

    """

    def __init__(self) -> None:
        """Start with a robot that was not seen yet."""
        self.is_lost = self.is_unanswered = False
        self._seen: deque[tuple[float, Place]] = deque()
        self._executed = self.confirmed = -math.inf
        self._delays: deque[tuple[float, float]] = deque()
        self._stands_since, self._waits, self._delay = math.inf, 0.0, 0.0

    def forget(self) -> None:
        """Take in that somebody else drives, or drove."""
        self.is_lost = self.is_unanswered = False
        self._seen.clear()
        self._delays.clear()
        self._executed = self.confirmed = -math.inf
        self._stands_since = math.inf
        self._delay = self._waits = 0.0

    @property
    def worst(self) -> float:
        """Return the longest delay lately beyond what was measured, [s]; 0 if there was none."""
        return max((delay for _, delay in self._delays), default=0.0)

    @property
    def now(self) -> float:
        """Return the longest delay there may be now beyond what was measured, [s], else 0."""
        return max(self.worst, self._waits)

    def on_pose(
        self, taken: float, place: Place, sent: SentCommands, least: float, most: float,
    ) -> None:
        """
        Take in where the robot was.

        Parameters
        ----------
        taken : float, [s]
            When, on the clock of ``sent``.
        place : tuple of float
            By its odometry alone.
        sent : SentCommands
        least, most : float, [s]
            How long a command takes until poses show it, as it was measured.

        """
        seen = self._seen
        if seen and not 0.0 < taken - seen[-1][0] < _APART:
            if -_APART < taken - seen[-1][0] <= 0.0:
                return  # one of before
            seen.clear()
        if not seen:
            self._executed = self.confirmed = max(self._executed, taken)
        seen.append((taken, place))
        while len(seen) > 2 and taken - seen[1][0] >= _SPANS[-1]:
            seen.popleft()
        looks = [(began, *_motion(start, place)) for began, start in self._looks(taken)]
        if not looks:
            return
        rests = abs(looks[0][1]) <= _STILL_WAY and abs(looks[0][2]) <= _STILL_TURN
        self._stands_since = min(self._stands_since, taken) if rests else math.inf
        delays = [self._explanation(look, taken, sent, least, most, rests) for look in looks]
        explained = [delay for delay in delays if delay is not None]
        if len(explained) == len(delays):
            self._executed = max(self._executed, taken - max(*explained, most + _BESIDE))
        self._delay = taken - self._executed
        self._confirm(looks, taken, sent)
        self._judge(taken, most, rests, sent)

    def _looks(self, taken: float) -> list[tuple[float, Place]]:
        """Return the poses from which on the motion is looked at, the latest first."""
        looks: list[tuple[float, Place]] = []
        for span in _SPANS:
            at = next((k for k in range(len(self._seen) - 2, -1, -1)
                       if taken - self._seen[k][0] >= span), None)
            if at is not None and (not looks or self._seen[at] != looks[-1]):
                looks.append(self._seen[at])
        return looks

    def _explanation(
        self, look: tuple[float, float, float], ended: float, sent: SentCommands,
        least: float, most: float, rests: bool,
    ) -> float | None:
        """
        Return the delay that explains a motion, [s]; None if nothing does.

        It is the least one; where commands were late just before, the greatest: nothing is taken
        to have arrived that may still be under way.
        """
        began, way, turn = look
        least, last = max(least - _BESIDE, 0.0), most + _BESIDE
        was_late = self._delay > last + _BESIDE
        if was_late and rests and any(
                v or w for v, w, _ in sent.pieces(self._executed, ended - last)):
            return None  # it may rest because nothing arrives, and what was sent may still do so
        end = min(self._delay, _MOST) if was_late else last if rests else max(_MOST, last)
        delays = [least + k * _STEP for k in range(int((max(end, last) - least) / _STEP + 1.5))]
        for delay in reversed(delays) if was_late else delays:
            if _explains(*sent.motion(began - delay, ended - delay), way, turn):
                return delay
        return None

    def _confirm(
        self, looks: list[tuple[float, float, float]], taken: float, sent: SentCommands,
    ) -> None:
        """Note what was executed for certain: that before the greatest delay which explains."""
        self.confirmed = max(self.confirmed, taken - _CALM)
        executed = self.confirmed
        while executed < taken:
            delay = taken - executed
            if all(_explains(*sent.motion(began - delay, executed), way, turn)
                   for began, way, turn in looks):
                self.confirmed = executed
                return
            executed += _STEP

    def _judge(self, taken: float, most: float, rests: bool, sent: SentCommands) -> None:
        while self._delays and self._delays[0][0] < taken - _REMEMBERED:
            self._delays.popleft()
        if self.is_lost and min(taken - self._stands_since, sent.stood_since(taken)) >= _CALM:
            self.is_lost, self._delay = False, 0.0
            self._executed = self.confirmed = taken
        is_late = self._delay > most + 2.0 * _BESIDE
        self.is_unanswered = rests and is_late
        self._waits = self._delay if self.is_unanswered else 0.0
        if is_late and not rests:
            self._delays.append((taken, self._delay))
        if is_late and self._delay > max(most, self.worst_before(taken)) + _TOO_LONG:
            self.is_lost = True

    def worst_before(self, taken: float) -> float:
        """Return the longest delay that was known a while ago, [s]."""
        return max((delay for at, delay in self._delays if at < taken - _CALM), default=0.0)


def _motion(start: Place, end: Place) -> tuple[float, float]:
    """Return how far forward and around a robot went, [m] and [rad]."""
    turn = math.remainder(end[2] - start[2], math.tau)
    middle = start[2] + 0.5 * turn
    way = (end[0] - start[0]) * math.cos(middle) + (end[1] - start[1]) * math.sin(middle)
    return way, turn


def _explains(sent_way: float, sent_turn: float, way: float, turn: float) -> bool:
    return _is_like(sent_way, way, _WAY) and _is_like(sent_turn, turn, _TURN)


def _is_like(sent: float, seen: float, spare: float) -> bool:
    if sent < 0.0:
        sent, seen = -sent, -seen
    return _SLOWER * sent - spare <= seen <= _FASTER * sent + spare
