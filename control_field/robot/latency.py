"""
How late a robot is heard and how late it answers, and where it may be by now.

A pose tells where the robot was at its stamp. Between then and now it went on by the commands that
had been sent and were not yet in that pose; which ones these are is known to within a few
hundredths of a second only. So there are several *ways* from the pose to now, and what is
decided has to be right on each of them.

Two lags are told apart. The *age* of a pose is the time from its stamp to its arrival. The
*response* is the time from sending a command until poses show it, by their stamps; it is measured
whenever a standing robot sets out. Where two clocks differ, the one is too small by what the other
is too great, and their sum is right all the same.
"""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
import math
from typing import Final

from control_field.robot.following import Following
from control_field.robot.limits import STANDSTILL, Velocity
from control_field.robot.sent_commands import moved_along, Piece, Place, SentCommands

#: Age from which a stamp is taken to be of another clock, [s].
OTHER_CLOCK: Final = 60.0
#: Time in which ages, gaps and losses are counted, [s]; poses that are enough to judge by.
WINDOW: Final = 5.0
ENOUGH: Final = 10
#: When most bases stop by themselves, [s]: the robot is slower before one that does so later.
_USUAL_TIMEOUT: Final = 0.5
#: How much longer that is while the robot stands although it was told to move, [s].
_DOUBT: Final = 0.3
#: Jitter from which on commands are repeated, [s].
_IRREGULAR: Final = 0.05
#: A silence from which on a link is known to be silent at times, [s], and for how long that is
#: remembered, [s].
SILENCE: Final = 0.3
_REMEMBERED: Final = 60.0
#: Poses that are looked at, at most: it takes time.
_MOST: Final = 250
#: Time in which ages are compared where clocks differ, [s].
_MOMENT: Final = 1.0
#: Losses below this share are taken for none: stamps are not that regular.
_LOSES: Final = 0.03
#: How often a command is repeated on a link that loses some, [s].
REPEAT: Final = 0.05
#: What a standing robot has to move to be seen moving, [m] and [rad].
_SEEN_WAY, _SEEN_TURN = 0.002, 0.01
#: Answers of the robot that are remembered, and how long one is waited for, [s].
_N_ANSWERS: Final = 6
_PATIENCE: Final = 3.0


@dataclass(frozen=True, slots=True)
class Lag:
    """
    What the collision monitor has to know of a late link.

    Parameters
    ----------
    ways : tuple of lists of (v, w, seconds)
        What the robot may have driven between the pose and now, one or the other.
    under_way : list of (v, w, seconds)
        What may still be under way, as no pose shows that it was done: any of it may be the last
        that arrives, and the rest is done when it arrives after all.
    hold : float, [s]
        How much longer than it should a command may be followed: until the robot stops by itself.
    is_late : bool
        Whether the link is worse than a good one.

    """

    ways: tuple[list[Piece], ...]
    under_way: list[Piece]
    hold: float
    is_late: bool = True


class Response:
    """
    Measures how long a command takes until poses show it.

    Attributes
    ----------
    answers : deque of (least, most, age), [s]
        The last ones: a pose at rest and a pose that had moved lie between; and how old poses
        came at that time.

    """

    def __init__(self) -> None:
        """Start with nothing measured."""
        self.answers: deque[tuple[float, float, float]] = deque(maxlen=_N_ANSWERS)
        self.departed_at: float | None = None
        self._from: Place = (0.0, 0.0, 0.0)
        self._last = -math.inf

    def on_departure(self, at: float, place: Place) -> None:
        """Take in that a robot at rest is told to move."""
        self.departed_at, self._from, self._last = at, place, -math.inf

    def on_pose(self, taken: float, place: Place, sent: SentCommands, age: float) -> None:
        """Take in where the robot was at a time, and how old poses come."""
        began = self.departed_at
        if began is None:
            return
        if taken - began > _PATIENCE:
            self.departed_at = None
        elif (math.hypot(place[0] - self._from[0], place[1] - self._from[1]) <= _SEEN_WAY and abs(
                math.remainder(place[2] - self._from[2], math.tau)) <= _SEEN_TURN):
            self._last = taken
        else:
            expected = sent.time_of(began, _SEEN_WAY, _SEEN_TURN)
            if expected is not None:
                most = taken - expected
                self.answers.append((min(most, max(self._last - expected, 0.0)), most, age))
            self.departed_at = None

    def bounds(self, age: float) -> tuple[float, float]:
        """
        Return the least and the most that it takes, [s], while poses come ``age`` old.

        Commands are taken to have become later by as much as poses have since it was measured,
        and before that to be as late as they are.
        """
        if not self.answers:
            return 0.0, max(age, 0.0)
        return (min(least for least, _, _ in self.answers),
                max(most + max(age - then, 0.0) for _, most, then in self.answers))

    @property
    def usual(self) -> float:
        """Return the usual one, [s]; 0 before the first."""
        if not self.answers:
            return 0.0
        middles = sorted(0.5 * (least + most) for least, most, _ in self.answers)
        return middles[len(middles) // 2]


class LatencyMonitor:
    """
    Watches over one link to a robot.

    Parameters
    ----------
    slow_from : float, [s]
        Latency from which the robot drives slower.
    base_timeout : float, [s]
        After it a robot that gets no command stops by itself.

    Attributes
    ----------
    sent : SentCommands
    age : float, [s]
        Of the newest pose when it came; above that of the freshest one where clocks differ.
    clocks_differ : bool
        Whether stamps are of another clock.
    jitter, lost : float
        Of the odometry, [s] and as a share.
    is_silent : bool
        Whether it was lately silent for longer than a burst takes.
    following : Following
        Whether the robot does what is sent.

    """

    def __init__(self, slow_from: float, base_timeout: float) -> None:
        """Start with a link that nothing is known of."""
        self.slow_from, self.base_timeout = slow_from, base_timeout
        self.sent = SentCommands()
        self.response = Response()
        self.following = Following()
        self.age = 0.0
        self.clocks_differ = False
        self._came: deque[tuple[float, float, float]] = deque(maxlen=_MOST)
        self._taken, self._place = -math.inf, (0.0, 0.0, 0.0)
        self._is_at_rest = False
        self.is_silent, self._silent_until = False, -math.inf
        self.jitter = self.worst_age = self.lost = self._gap = self._least = 0.0

    def on_pose(self, at: float, stamp: float, place: Place, odometry: Place | None = None,
              is_ours: bool = True) -> None:
        """
        Take in a pose.

        Parameters
        ----------
        at : float, [s]
            Now, on the clock that is the stamps' if there is one clock for both.
        stamp : float, [s]
            When the pose was taken.
        place : tuple of float
            Where the robot was.
        odometry : tuple of float, optional
            The same by its wheels alone, where ``place`` was mended.
        is_ours : bool
            Whether it is driven by what is sent here, and nobody else drives it.

        """
        raw = at - stamp
        differ = abs(raw) > OTHER_CLOCK
        if differ != self.clocks_differ or (self._came and not (
                -WINDOW < at - self._came[-1][0] < OTHER_CLOCK)):
            self._came.clear()
            self.clocks_differ = differ
        # What is missing in a moment is a burst that was too much for somebody, no silence.
        elif self._came and min(
                stamp - self._came[-1][1], at - self._came[-1][0]) > SILENCE + 3.0 * self._gap:
            self._silent_until = at + _REMEMBERED
        self._came.append((at, stamp, raw))
        while self._came[0][0] < at - WINDOW:
            self._came.popleft()
        self._judge(at)
        self.age = raw - (self._least if differ else min(self._least, 0.0))
        before, self._taken, self._place = self._place, at - self.age, place
        self._is_at_rest = math.dist(before, place) < 1e-3
        self.response.on_pose(self._taken, place, self.sent, self.worst_age)
        if is_ours and self._is_our_time():
            least, most = self.response.bounds(self.worst_age)
            unsure = self.jitter if differ else 0.0
            self.following.on_pose(
                self._taken, odometry or place, self.sent, least - unsure, most + unsure)
        else:
            self.following.forget()

    def _is_our_time(self) -> bool:
        """Return whether the stamps' seconds are as long as ours: a simulator's need not be."""
        if not self.clocks_differ:
            return True
        (first, began, _), (last, ended, _) = self._came[0], self._came[-1]
        return len(self._came) >= ENOUGH and abs(ended - began - (last - first)) < 0.1 * (
            last - first)

    def on_command(self, at: float, velocity: Velocity) -> None:
        """Take in a command that goes to the wheels now."""
        if (velocity != STANDSTILL and self.sent.newest == STANDSTILL and self._is_at_rest
                and self.sent.stood_since(at) > self.longest + 0.1):
            self.response.on_departure(at, self._place)
        self.sent.note(at, velocity)

    def _judge(self, at: float) -> None:
        """Judge what came in the window: how irregular, how much is missing."""
        ages = self._ages()
        self._least, most = min(ages), max(ages)
        least = self._least
        self.jitter = most - least
        self.worst_age = most - (least if self.clocks_differ else min(least, 0.0))
        self.lost = self._share_lost()
        self.is_silent = at < self._silent_until

    def _ages(self) -> list[float]:
        """
        Return the ages in the window, [s].

        Where clocks differ, one may also run faster, and not always by as much: a simulator's on
        a busy machine. What grows at a steady rate for a second is that, then.
        """
        if not self.clocks_differ:
            return [raw for _, _, raw in self._came]
        last = self._came[-1][0] - _MOMENT
        times, ages = zip(*((at, raw) for at, _, raw in self._came if at >= last), strict=True)
        part = len(ages) // 4
        if not part:
            return list(ages)
        rate = (sum(ages[-part:]) - sum(ages[:part])) / max(
            sum(times[-part:]) - sum(times[:part]), 1e-9)
        return [age - rate * (at - times[-1]) for age, at in zip(ages, times, strict=True)]

    def _share_lost(self) -> float:
        if len(self._came) < ENOUGH:
            return 0.0
        stamps = [stamp for _, stamp, _ in self._came]
        gaps = sorted(later - earlier for earlier, later in pairwise(stamps))
        usual, whole = gaps[len(gaps) // 5], stamps[-1] - stamps[0]
        self._gap = max(usual, 0.0)
        if usual <= 0.0 or whole <= 0.0:  # stamps of two senders go back and forth
            return 0.0
        return min(max(1.0 - (len(gaps) + 0.5) * usual / whole, 0.0), 0.95)

    @property
    def is_lossy(self) -> bool:
        """Return whether commands are to be repeated, as some may not arrive."""
        return self.lost > _LOSES or self.following.worst > 0.0 or (
            not self.clocks_differ and (self.is_silent or self.jitter > _IRREGULAR))

    @property
    def is_late(self) -> bool:
        """Return whether the link is worse than a good one."""
        return self.slowing < 1.0 or self.is_lossy

    @property
    def longest(self) -> float:
        """Return the longest time from a command to the arrival of a pose that shows it, [s]."""
        return self.worst_age + max(
            self.response.bounds(self.worst_age)[1], self.following.worst, 0.0)

    @property
    def slowing(self) -> float:
        """Return the share of the speed that is driven at this latency, above 0 to 1."""
        latency = self.longest + self.jitter
        return 1.0 if latency <= self.slow_from else self.slow_from / latency

    @property
    def patience(self) -> float:
        """Return how many times longer than on a good link the same way may take."""
        return max(1.0, self.base_timeout / _USUAL_TIMEOUT) / self.slowing

    def predicted(self, place: Place, now: float) -> Place:
        """Return where the robot is likely to be when a command of now begins to count."""
        return moved_along(place, self.sent.pieces(self._taken - self.response.usual, now))

    def lag(self, now: float) -> Lag:
        """Return where the robot may be by now."""
        silence = now - self._came[-1][0] - self._gap if self._came else 0.0
        least, most = self.response.bounds(max(self.worst_age, self.age + silence))
        most = max(most, self.following.now) + self.jitter
        starts = {self._taken - least, self._taken - most, self._taken - self.response.usual,
                  self._taken - 0.5 * (least + most)}
        if self.response.departed_at is not None:
            starts.add(self.response.departed_at)
        ways = [self.sent.pieces(start, now) for start in starts]
        doubt = _DOUBT if self.following.is_unanswered else 0.0
        return Lag(tuple(ways), self.sent.pieces(self._arrived_until(most), now),
                   self.base_timeout + doubt, self.is_late)

    def _arrived_until(self, most: float) -> float:
        """
        Return what was sent before has arrived for certain, [s], where ``most`` was measured.

        A robot that moves has heard something since it would have stopped by itself.
        """
        measured, confirmed = self._taken - most, self.following.confirmed
        if not math.isfinite(confirmed):
            return measured
        if self.clocks_differ:
            confirmed -= self.jitter
        if not self._is_at_rest:
            confirmed = max(confirmed, measured - self.base_timeout)
        return min(measured, confirmed)
