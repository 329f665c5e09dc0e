"""Why a bag teaches nothing, or is not one of a task; each says it in a line for people."""

from pathlib import Path

from control_field.grid import Grid
from episode_store.rosbag2.errors import BagError
from msgs_bridge.untrusted.text import printable


class NothingToLearnError(BagError):
    """
    A bag is readable, but there is nothing in it to learn from.

    Parameters
    ----------
    path : Path
        The bag's folder.
    why : str
        What is wrong with it.
    frame : str
        The frame that its poses are in, if that is what is wrong.
    code : str
        What is wrong, for a page that has words of its own; empty for what is rare.

    """

    def __init__(self, path: Path, why: str, frame: str = '', code: str = '') -> None:
        """Keep all of them."""
        super().__init__(f'{path}: {why}')
        self.why, self.frame, self.code = printable(why), frame, code


class NothingThereError(BagError):
    """There is no bag to do with what is asked for."""


class NoSuchMomentError(BagError):
    """A drive does not reach a moment that somebody asks for."""


class UnwritableError(BagError):
    """A bag cannot be mended: no permission, a read-only or a full disk."""


class WorkspaceError(BagError):
    """A bag was recorded in another workspace."""


class OtherFrameError(BagError):
    """
    No pose of a drive is in the frame of the workspace.

    Parameters
    ----------
    message : str
    frame : str
        The one that they are in.

    """

    def __init__(self, message: str, frame: str) -> None:
        """Keep both."""
        super().__init__(message)
        self.frame = frame


class OutsideDriveError(BagError):
    """
    The drive of a bag leaves the workspace.

    Parameters
    ----------
    message : str
    fitting : Grid or None
        A workspace that holds the whole drive; None if none does.

    """

    def __init__(self, message: str, fitting: Grid | None) -> None:
        """Keep both."""
        super().__init__(message)
        self.fitting = fitting
