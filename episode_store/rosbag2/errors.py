"""Errors of bags: each is one line for a person."""

from pathlib import Path

from msgs_bridge.untrusted.files import OddFileError
from msgs_bridge.untrusted.text import printable


class BagError(ValueError):
    """A bag cannot be read or written; the message is one line that says what and why."""

    def __init__(self, message: str) -> None:
        """Make it one printable line, whatever names of files or from a bag are in it."""
        super().__init__(printable(message))


def mcap_path(folder: Path) -> Path:
    """Return the path of the MCAP file in the folder of one of our bags."""
    return folder / f'{folder.name}_0.mcap'


def error_line(action: str, path: Path, error: OSError) -> str:
    """Return one line on what could not be done, where and why."""
    if isinstance(error, OddFileError):
        path = Path(error.filename)
        return f'cannot {action} {path}: {error.strerror}'
    return f'cannot {action} {path}: {(error.strerror or str(error)).lower()}'
