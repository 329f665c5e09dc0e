"""What to set where odometry is in another frame than the workspace."""

import re
from typing import Final

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
