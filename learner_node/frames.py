"""What to set where odometry is in another frame than the workspace."""

from collections.abc import Callable
import re
from typing import Any, Final

from msgs_bridge.poses import problem_with_frame

_OTHER: Final = re.compile(r"frame is '([^']+)', must be '")


def other_frame(text: str) -> str:
    """Return the frame that a refusal names as the wrong one; empty if it is about no frame."""
    found = _OTHER.search(text)
    return found[1] if found else ''


def with_remedy(text: str) -> str:
    """Return a refusal, with what to set if it is about a frame; the controller follows."""
    frame = other_frame(text)
    if not frame:
        return text
    return f'{text}; if that is the right one, start learner_node with frame_id:={frame}'


class FrameCheck:
    """
    Says at the beginning of a demonstration if its odometry is in another frame.

    Parameters
    ----------
    frame_id : str
        Of the workspace.
    say : callable
        Is told the line, and that it is a warning.

    """

    def __init__(self, frame_id: str, say: Callable[[str, bool], None]) -> None:
        self._frame_id = frame_id
        self._say = say
        #: Whether the next odometry is to be looked at.
        self.is_due = False

    def saw(self, msg: Any) -> None:
        """Take in the first odometry of a demonstration."""
        self.is_due = False
        wrong = problem_with_frame(msg.header.frame_id, self._frame_id, 'odom')
        if wrong:
            self._say(with_remedy(f'nothing can be learnt from this drive: {wrong}'), True)
