"""What measuring a page needs: real nodes, who hears them, a browser that can be killed."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, ExitStack, suppress
from dataclasses import dataclass
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any, Final, NamedTuple

from playwright.sync_api import Browser, Page, sync_playwright
from websockets.sync.client import connect
from websockets.typing import Origin

from experience_cli.demo.page_door import wait_for_address
from experience_cli.demo.processes import Children, own_domain

#: How long one waits for what ought to come, [s].
_PATIENCE: Final = 120.0
#: What counts as standing, [m/s, rad/s].
_STILL: Final = 1e-3


class Heard(NamedTuple):
    """A command or an odometry, as another process heard it."""

    at: float
    wall: float
    topic: str
    v: float
    w: float

    @property
    def stands(self) -> bool:
        """Whether it is a standstill."""
        return max(abs(self.v), abs(self.w)) < _STILL


@dataclass
class Bench:
    """
    Nodes, a listener, and where the page is.

    Parameters
    ----------
    children : Children
    url : str
    log : Path
        What the listener writes.

    """

    children: Children
    url: str
    log: Path

    def heard(self) -> list[Heard]:
        """Return all that was heard so far."""
        rows = (line.split() for line in self.log.read_text().splitlines(keepends=True)
                if line.endswith('\n'))
        return [Heard(float(row[0]), float(row[1]), row[2], float(row[3]), float(row[4]))
                for row in rows]

    def wait(self, predicate: Callable[[], Any], what: str) -> Any:
        """Wait until something is so."""
        end = time.monotonic() + _PATIENCE
        while not (found := predicate()):
            self.children.check()
            if time.monotonic() > end:
                raise TimeoutError(f'{what} did not come')
            time.sleep(0.01)
        return found

    def warm_up(self) -> None:
        """Drive until the robot moves, for all to have found each other."""
        since = time.monotonic()
        with self.socket('drive') as socket:
            self.wait(lambda: socket.send(json.dumps(
                {'t': 1e3 * time.monotonic(), 'v': 0.0, 'w': 1.0})) or self.has_moved(since),
                'the first movement')
        self.wait_for_rest()

    def has_moved(self, since: float) -> bool:
        """Return whether the robot has moved since a time."""
        return any(each.at > since and each.topic == 'odom' and not each.stands
                   for each in self.heard()[-20:])

    def wait_for_movement(self, since: float) -> None:
        """Wait until the robot has moved since a time."""
        self.wait(lambda: self.has_moved(since), 'the movement')

    def wait_for_rest(self, seconds: float = 0.7) -> None:
        """Wait until nothing but standstill was heard for a while."""
        self.wait(lambda: all(
            each.stands for each in self.heard() if each.at > time.monotonic() - seconds), 'rest')

    def socket(self, path: str, **options: Any) -> Any:
        """Return a socket of the page, as the page itself opens it."""
        return connect(self.url.replace('http', 'ws', 1) + path,
                       origin=Origin(self.url.rstrip('/')), **options)


@contextmanager
def running(
    nodes: Mapping[str, Mapping[str, object]], has_arrows: bool = False,
) -> Iterator[Bench]:
    """Start nodes and a listener, and the page."""
    with tempfile.TemporaryDirectory() as name, own_domain() as environment:
        folder = Path(name)
        with Children(folder, environment) as children:
            for node, parameters in nodes.items():
                children.start_node(node, parameters)
            children.start_node('page_node', {
                'port': 0, 'bags': str(folder / 'bags'), 'simulation': True})
            log = folder / 'heard.txt'
            children.start('hear', [
                sys.executable, '-m', 'benchmarks.page_peers', 'hear', str(log)])
            if has_arrows:
                children.start('arrows', [sys.executable, '-m', 'benchmarks.page_arrows'])
            bench = Bench(children, wait_for_address(children), log)
            bench.wait(lambda: log.exists() and len(bench.heard()) > 20, 'odometry')
            yield bench


ROBOT: Final[Mapping[str, Mapping[str, object]]] = {
    'sim_node': {'world': 'open', 'rate': 20.0}, 'control_field_node': {}}


class Chromium:
    """A browser of its own, with all its processes in reach; ended with the context."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._stack = ExitStack()

    def __enter__(self) -> 'Chromium':
        """Start it and open the page."""
        path = shutil.which('chromium') or 'chromium'
        options = ['--headless', '--no-first-run', '--remote-debugging-port=0',
                   f'--user-data-dir={self._folder.name}', *(
                       () if os.getuid() else ('--no-sandbox',))]
        self._process = subprocess.Popen(
            [path, *options], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True)
        port = Path(self._folder.name) / 'DevToolsActivePort'
        end = time.monotonic() + _PATIENCE
        while not (port.exists() and '\n' in port.read_text()) and time.monotonic() < end:
            time.sleep(0.02)
        address = f'http://127.0.0.1:{port.read_text().split()[0]}'
        self._playwright = self._stack.enter_context(sync_playwright())
        browser: Browser = self._playwright.chromium.connect_over_cdp(address)
        self.page: Page = browser.contexts[0].new_page()
        self.page.goto(self._url)
        return self

    def pids(self, kind: str = '') -> list[int]:
        """Return its processes, or those of a kind, such as ``renderer``."""
        parents = {int(each.name): _parent(each) for each in Path('/proc').iterdir()
                   if each.name.isdecimal()}
        found = [self._process.pid]
        for pid in found:
            found += [child for child, parent in parents.items() if parent == pid]
        return [pid for pid in found if f'--type={kind}' in _command(pid) or not kind]

    def send(self, number: int, kind: str = '') -> float:
        """Send a signal to them; return when the first one got it, [s]."""
        pids = self.pids(kind)
        now = time.monotonic()
        for pid in pids:
            with suppress(ProcessLookupError):
                os.kill(pid, number)
        return now

    def __exit__(self, *error: object) -> None:
        """Kill it."""
        self.send(signal.SIGKILL)
        self._process.wait()
        with suppress(Exception):
            self._stack.close()
        with suppress(OSError):
            self._folder.cleanup()


def _parent(process: Path) -> int:
    with suppress(OSError):
        return int((process / 'stat').read_text().rpartition(')')[2].split()[1])
    return 0


def _command(pid: int) -> str:
    with suppress(OSError):
        return Path(f'/proc/{pid}/cmdline').read_text().replace('\0', ' ')
    return ''
