"""Where the page of a running `page_node` is, and a browser that opens it."""

import os
from pathlib import Path
import re
import signal
import socket
import subprocess
import sys
import time
from typing import Final, NoReturn

from experience_cli.demo.processes import Children
from experience_cli.errors import UserError

#: Name of the node, and of its log.
PAGE: Final = 'page_node'
#: How long a page may take to come up, [s]: the machine may be busy with something else.
_PATIENCE: Final = 60.0
#: Where a page is if nobody says.
_PORT: Final = 8300
_PERIOD: Final = 0.05
#: How often it is looked whether all nodes still run, [s].
_WATCH_PERIOD: Final = 0.2
_ADDRESS: Final = re.compile(rb'https?://[^\s\'"<>]+')
#: One of these is set where windows can be shown.
_SCREENS: Final = ('DISPLAY', 'WAYLAND_DISPLAY')


def free_port(host: str) -> int:
    """Return the usual port if it is free, else 0, for which the system chooses one."""
    family = socket.AF_INET6 if ':' in host else socket.AF_INET
    with socket.socket(family) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((host, _PORT))
        except OSError:
            return 0
    return _PORT


def wait_for_address(children: Children) -> str:
    """
    Return the address that `page_node` says it has.

    Raises
    ------
    UserError
        If it ends before, or says nothing.

    """
    end = time.monotonic() + _PATIENCE
    while time.monotonic() < end:
        # What it said before it ended counts, too: first looked at, then read.
        children.check()
        if found := _ADDRESS.search(children.log(PAGE).read_bytes()):
            return found[0].decode(errors='replace')
        time.sleep(_PERIOD)
    raise UserError(f'{PAGE} has named no address for {_PATIENCE:.0f} s '
                    f'(see {children.log(PAGE)})')


def has_screen() -> bool:
    """Return whether a window can be shown here."""
    return sys.platform == 'darwin' or any(os.environ.get(name) for name in _SCREENS)


def open_browser(address: str, log: Path) -> None:
    """Open a page in the user's browser, which lives on; what it says goes into a file."""
    with log.open('ab') as file:
        subprocess.Popen(
            [sys.executable, '-m', 'webbrowser', address], stdin=subprocess.DEVNULL, stdout=file,
            stderr=subprocess.STDOUT, start_new_session=True)


def show(address: str, log: Path, wants_browser: bool = True) -> None:
    """Say where the page is, and open it where there is a screen."""
    opens = has_screen() and wants_browser
    print(f'{"A browser opens" if opens else "Open in a browser:"} {address}')
    print('Ctrl-C here ends the page, and all that it has started.', flush=True)
    if opens:
        open_browser(address, log)


def watch(children: Children) -> NoReturn:
    """Wait until somebody ends it, or a node ends by itself."""
    while True:
        children.check()
        time.sleep(_WATCH_PERIOD)


def be_stopped() -> None:
    """Take it that somebody has ended what runs until it is ended."""
    # The signal would be heard again where it could have been lost.
    signal.setitimer(signal.ITIMER_REAL, 0.0)
