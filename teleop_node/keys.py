"""Bytes from a terminal to keys, and keys to what they mean."""

from collections.abc import Mapping
from typing import Final, NamedTuple

from msgs_bridge.teaching.actions import Action

#: Time after which an escape character that nothing followed was the Esc key, [s]. Over a slow
#: line the rest of an arrow key's sequence may come that much later.
ESCAPE_TIME: Final = 0.1
#: Time within which the same key again is the terminal repeating a key that is held, [s]: longer
#: than the delay before the first repeat, which is 0.25 to 0.66 s.
REPEAT_TIME: Final = 0.8

#: No key has a longer one, in bytes; what does not end by then is waited for no longer.
_LONGEST_SEQUENCE: Final = 64

ESCAPE: Final = '\x1b'
#: Any key that has no letter: arrows, function keys, letters with accents.
OTHER: Final = ''
#: What a terminal that is asked to (`terminal.Terminal`) sends around what is pasted.
PASTE_BEGINS: Final = '\x1b[200~'
PASTE_ENDS: Final = '\x1b[201~'

ACTIONS: Final[Mapping[str, Action]] = {
    's': Action.START, 'n': Action.KEEP, 'r': Action.REDO, 'a': Action.CANCEL,
    'd': Action.DROP_LAST, 'b': Action.UNDO, 'y': Action.LABEL_SUCCESS,
    'f': Action.LABEL_FAILURE, 't': Action.RUN_TRIALS, 'g': Action.SET_BACK,
    'h': Action.TEACH_HERE,
    ' ': Action.STOP, ESCAPE: Action.QUIT}

HELP: Final = """\
drive (hold to move)     teach                      afterwards
  u  i  o                s  start to record         t  let the robot try
  j     l                n  keep the drive          y  the last one went well
  m  ,  .                r  begin it again          f  the last one went wrong
space or k: stop         a  throw it away           d  remove the last one
faster, slower: q/z      g  back to the start       b  bring the removed back
  w/x ahead, e/c turn    h  where teaching helps    Esc  quit"""


class KeyParser:
    """
    Makes keys of what a terminal sends.

    A key is one character, `ESCAPE` for the Esc key, `OTHER`, or one of the marks of a paste.
    """

    def __init__(self) -> None:
        """Start with nothing received."""
        self._rest = b''
        self._since = 0.0

    def feed(self, data: bytes, now: float) -> list[str]:
        """
        Parse bytes; call it without any, too, so that a lone Esc is noticed.

        Parameters
        ----------
        data : bytes
            What has arrived, perhaps nothing.
        now : float, [s]
            On a steady clock.

        Returns
        -------
        list of str
            Keys, in order.

        """
        if data:
            self._rest += data
            self._since = now
        keys: list[str] = []
        while self._rest:
            length = key_length(self._rest)
            if length is None:
                if now - self._since < ESCAPE_TIME:
                    break
                length = len(self._rest)
            keys.append(key_from_bytes(self._rest[:length]))
            self._rest = self._rest[length:]
        return keys


def key_length(data: bytes) -> int | None:
    """Return how many bytes the first key has; None if that cannot be told yet."""
    if data[0] == 0x1b:
        return _sequence_length(data)
    length = 2 if 0xc2 <= data[0] < 0xe0 else 3 if 0xe0 <= data[0] < 0xf0 else (
        4 if 0xf0 <= data[0] < 0xf5 else 1)
    return length if len(data) >= length else None


def _sequence_length(data: bytes) -> int | None:
    """Return the length of an escape sequence: Esc, CSI (Esc [), SS3 (Esc O) or Alt and a key."""
    if len(data) == 1:
        return None
    if data[1] == 0x1b:
        return 1
    if data[1:2] == b'O' or data[1:3] == b'[[':  # the latter: F1 to F5 of a Linux console
        length = 3 if data[1:2] == b'O' else 4
        return length if len(data) >= length else None
    if data[1:2] != b'[':
        return 2
    for index in range(2, len(data)):
        if not 0x20 <= data[index] < 0x40:
            return index + 1
    return None if len(data) < _LONGEST_SEQUENCE else len(data)


def key_from_bytes(data: bytes) -> str:
    """Return the key of the bytes that belong to it."""
    if (mark := data.decode('latin-1')) in (PASTE_BEGINS, PASTE_ENDS):
        return mark
    return chr(data[0]) if len(data) == 1 and data[0] < 0x80 else OTHER


class Press(NamedTuple):
    """A key, and whether it was pressed anew or is held."""

    key: str
    is_new: bool


class RepeatDetector:
    """Tells a new press from the repeats of a key that is held."""

    def __init__(self) -> None:
        """Start with nothing pressed."""
        self._key: str | None = None
        self._at = 0.0

    def press(self, key: str, now: float) -> Press:
        """Return a key that has come, as a new press or a repeat of the last one."""
        is_new = key != self._key or now - self._at > REPEAT_TIME
        self._key, self._at = key, now
        return Press(key, is_new)
