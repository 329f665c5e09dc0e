"""What is missing of a bag that was not closed: looked at, not mended."""

from pathlib import Path
import re
from typing import Final

from control_field.words import counted
from episode_store.repair import needs_repair
from episode_store.rosbag2.errors import BagError, error_line, mcap_path
from episode_store.rosbag2.mcap_scan import MAGIC
from episode_store.rosbag2.metadata import NAME
from episode_store.rosbag2.reader import BagReader
from msgs_bridge.untrusted.files import open_regular, read_bytes

#: How many messages a bag held when it was closed: in ``metadata.yaml``, of all topics and files.
_COUNT: Final = re.compile(rb'^  message_count: (\d{1,18})\r?$', re.MULTILINE)


def has_its_end(folder: Path | str) -> bool:
    """
    Tell whether a bag ends like one that was closed; that is a glance, not a look at its index.

    Raises
    ------
    BagError
        If it cannot be read.

    """
    folder = Path(folder)
    try:
        if not (folder / NAME).exists() or not mcap_path(folder).exists():
            return False
        with open_regular(mcap_path(folder), folder) as file:
            if file.seek(0, 2) <= 2 * len(MAGIC):
                return False
            file.seek(-len(MAGIC), 2)
            return file.read() == MAGIC
    except OSError as error:
        raise BagError(error_line('read', folder, error)) from None


def missing_of_bag(folder: Path | str) -> str:
    """
    Say what of a bag of ours is missing, as `repair_bag` would; empty for a whole one.

    Raises
    ------
    BagError
        If it cannot be read.

    """
    folder = Path(folder)
    if not needs_repair(folder):
        return ''
    path = mcap_path(folder)
    if not path.exists() or path.stat().st_size == 0:
        return 'it is empty: its recorder was stopped at once'
    reader = BagReader(path, verify=True)
    if not reader.damage:
        return f'{NAME} is missing; no message is missing'
    times = [reader.messages_of([number]).log_times for number in reader.channels]
    n_messages = sum(map(len, times))
    lost = (f'{counted(reader.n_lost_bytes, "byte")} cannot be read' if reader.n_lost_bytes
            else 'what came after is missing')
    if not n_messages:
        return f'{reader.damage}; no message can be read; {lost}'
    n_recorded = _n_recorded(folder)
    of_all = f'{n_messages} of ' if n_recorded > n_messages else ''
    found = (f'{reader.damage}; {of_all}{counted(max(n_messages, n_recorded), "message")} '
             f'can be read')
    if reader.complete:
        return f'{found}, no message is missing'
    last = max(int(each.max()) for each in times if len(each)) / 1e9
    return f'{found}, the last at {last:.3f} s; {lost}'


def _n_recorded(folder: Path) -> int:
    """Return how many messages a bag held when it was closed; 0 if it never was."""
    try:
        found = _COUNT.search(read_bytes(folder / NAME, within=folder))
    except OSError:
        return 0
    return int(found[1]) if found else 0
