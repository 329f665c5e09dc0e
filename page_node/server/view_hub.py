"""What the viewers get: the newest frame of each kind, and no viewer waits for another."""

from collections.abc import Mapping, Sequence
import json
from threading import Lock
from typing import Any, Final

from page_node.big_frames import bytes_from_frame
from page_node.exchange import json_bytes

#: Greatest number of messages that a viewer may have on their way.
MOST_UNSEEN: Final = 2

Point = tuple[float, float]
#: A message: text for a batch of frames, bytes for a big one.
Message = str | bytes


class Frame:
    """A frame, written once however many there are to read it."""

    def __init__(self, kind: str, content: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
        """Keep it until somebody wants to see it."""
        self.kind, self.is_big = kind, bool(arrays)
        self._content, self._arrays = content, arrays
        self._written: Message | None = None

    @property
    def written(self) -> Message:
        """Return it as it goes over the wire."""
        if self._written is None:
            self._written = (bytes_from_frame(self._content, self._arrays) if self.is_big
                             else json_bytes(self._content).decode())
        return self._written


class Viewer:
    """
    What one viewer has got and what it has seen of that.

    Parameters
    ----------
    hub : ViewHub

    """

    def __init__(self, hub: 'ViewHub') -> None:
        """Start with nothing."""
        self._hub = hub
        self._version = 0
        self._trail = (-1, 0)  # of which way it has how many points
        self.n_sent = self.n_seen = 0

    @property
    def is_ready(self) -> bool:
        """Whether it has seen enough of what it got to get more."""
        return self.n_sent - self.n_seen < MOST_UNSEEN

    def see(self, count: int) -> bool:
        """Note that it has seen so many messages; False if there were not so many."""
        if not self.n_seen <= count <= self.n_sent:
            return False
        self.n_seen = count
        return True

    def messages(self) -> list[Message]:
        """Return what is new for it: at most a batch and then big frames, each one a message."""
        frames, self._version = self._hub.since(self._version)
        more, self._trail = self._hub.trail_since(self._trail)
        batch = [*(str(frame.written) for frame in frames if not frame.is_big), *more]
        found: list[Message] = [f'[{",".join(batch)}]'] if batch else []
        found += [frame.written for frame in frames if frame.is_big]
        self.n_sent += len(found)
        return found


class ViewHub:
    """
    Keeps the newest frame of each kind, and the way driven, for whoever looks.

    Frames come from the thread of ROS, viewers are served in that of the server.
    """

    def __init__(self) -> None:
        """Start with nothing to see."""
        self._lock = Lock()
        self._frames: dict[str, tuple[int, Frame]] = {}
        self._version = 0
        self._trail_kind, self._trail, self._n_trails = '', [], 0  # type: str, list[Point], int

    def put(
        self, kind: str, content: Mapping[str, Any], arrays: Mapping[str, Any] | None = None,
    ) -> None:
        """
        Show a frame instead of the last one of its kind.

        Parameters
        ----------
        kind : str
            Becomes its `type`.
        content : mapping
            What is written as JSON; not changed any more by who gave it.
        arrays : mapping of str to ndarray, optional
            With these it becomes a big frame, see `page_node.big_frames`; not changed either.

        """
        frame = Frame(kind, {'type': kind, **content}, arrays or {})
        with self._lock:
            self._version += 1
            self._frames[kind] = self._version, frame

    def drop(self, kind: str) -> None:
        """Show a kind no more to who comes later."""
        with self._lock:
            self._frames.pop(kind, None)

    def begin_trail(self, kind: str, points: Sequence[Point] = ()) -> None:
        """Begin the way driven anew: ``demo``, ``trial``, or nothing in particular."""
        with self._lock:
            self._trail_kind, self._trail = kind, list(points)
            self._n_trails += 1

    def extend_trail(self, points: Sequence[Point]) -> None:
        """Add to the way driven."""
        with self._lock:
            self._trail.extend(points)

    def since(self, version: int) -> tuple[list[Frame], int]:
        """Return the frames that came after a version, oldest first, and the version now."""
        with self._lock:
            if version == self._version:
                return [], version
            newer = sorted((entry for entry in self._frames.values() if entry[0] > version),
                           key=lambda entry: entry[0])
            return [frame for _, frame in newer], self._version

    def trail_since(self, had: tuple[int, int]) -> tuple[list[str], tuple[int, int]]:
        """Return what of the way driven is new to who has so many points of such a one."""
        with self._lock:
            number, n_points = had
            have = self._n_trails, len(self._trail)
            if had == have:
                return [], had
            if number != self._n_trails:
                return [_written('trail', self._trail, self._trail_kind)], have
            return [_written('trail_more', self._trail[n_points:], self._trail_kind)], have


def _written(kind: str, points: Sequence[Point], way: str) -> str:
    return json.dumps({'type': kind, 'kind': way, 'points': points}, separators=(',', ':'))
