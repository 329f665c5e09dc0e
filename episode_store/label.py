"""What a person said of a bag afterwards, kept beside the recording in ``metadata.yaml``."""

from pathlib import Path
from typing import Final

from episode_store.rosbag2.errors import BagError, error_line
from episode_store.rosbag2.metadata import custom_data, NAME, with_note, write_atomically
from msgs_bridge.messages.trial_status import Label
from msgs_bridge.untrusted.files import read_bytes, read_text

#: The key in rosbag2's ``custom_data``.
KEY: Final = 'experience_label'
#: What stands there when a person took back what was said.
_NONE: Final = 'none'


def read_label(folder: Path | str) -> Label | None:
    """
    Return what a person said of a bag after it was recorded.

    Parameters
    ----------
    folder : Path
        The bag's folder.

    Returns
    -------
    Label or None
        None if nothing was said since: then what was recorded holds.

    Raises
    ------
    BagError
        If ``metadata.yaml`` cannot be read, or holds a label that there is not.

    """
    path = Path(folder) / NAME
    try:
        content = read_bytes(path, within=folder)
        # Relearning reads thousands of these files: parsing each would take a while.
        if KEY.encode() not in content:
            return None
        word = custom_data(content.decode()).get(KEY)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise BagError(error_line('read', path, error)) from None
    except ValueError as error:
        raise BagError(f'cannot read {path}: {error}') from None
    return None if word is None else label_from_text(word, path)


def label_from_text(text: str, path: Path | str) -> Label:
    """
    Return the label of a word.

    Raises
    ------
    BagError
        If it is none of success, failure and none; ``path`` says where it stands.

    """
    if text == _NONE:
        return Label.NONE
    if text not in (Label.SUCCESS, Label.FAILURE):
        raise BagError(f'{path}: {KEY} is {text!r}, must be success, failure or none')
    return Label(text)


def write_label(folder: Path | str, label: Label | None) -> None:
    """
    Keep what a person says of a bag; nothing that was recorded is changed.

    Parameters
    ----------
    folder : Path
        The bag's folder, whose recording was closed.
    label : Label or None
        `Label.NONE` takes back what was said while it was recorded; None leaves no trace of what
        was said afterwards. `judgement.judge_bag` knows which is called for.

    Raises
    ------
    BagError
        If it cannot be written, or the bag was not closed.

    """
    path = Path(folder) / NAME
    try:
        text = read_text(path, within=folder)
    except FileNotFoundError:
        raise BagError(f'{folder} was not closed, it has no {NAME}: mend it with '
                       f'`experience repair {folder}`') from None
    except OSError as error:
        raise BagError(error_line('read', path, error)) from None
    except UnicodeDecodeError as error:
        raise BagError(f'cannot read {path}: {error}') from None
    value = None if label is None else str(label) or _NONE
    write_atomically(path, with_note(text, KEY, value, path).encode())
