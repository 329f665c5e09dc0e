"""Child processes that end with their parent, however that ends."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
import ctypes
import fcntl
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time
from types import FrameType
from typing import Any, Final

from experience_cli.errors import UserError
from experience_cli.interrupts import interrupt, Stopped
from msgs_bridge.node.environment import child_environment, ENDING_SIGNALS
from msgs_bridge.untrusted.files import check_folder, open_lock

#: How long a child may take to end by itself, [s].
PATIENCE: Final = 5.0
#: Domains that nobody chooses by hand; above 101 some systems run out of ports.
DOMAINS: Final = tuple(domain for domain in range(1, 101) if domain % 10)
_PR_SET_PDEATHSIG: Final = 1
#: Nodes find each other on this machine only.
_THIS_MACHINE: Final = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'ROS_STATIC_PEERS': ''}


class Children:
    """
    Processes that this one has started; a context that stops all of them at its end.

    Parameters
    ----------
    folder : Path
        Where their output goes, a file each.
    environment : mapping of str to str
        Variables on top of this process's own.

    """

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self.folder = folder
        self._environment = child_environment({'PYTHONUNBUFFERED': '1', **environment})
        self._running: dict[str, subprocess.Popen[bytes]] = {}
        self._interrupted = 0
        self._before: dict[int, Any] = {}

    def __enter__(self) -> 'Children':
        """Return the context; from now on Ctrl-C is noted for `check` to raise."""
        self._before = {number: signal.signal(number, self._interrupt) for number in ENDING_SIGNALS
                        if signal.getsignal(number) is not signal.SIG_IGN}
        return self

    def __exit__(self, *error: object) -> None:
        """Stop every child."""
        self.stop()
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        # Raised inside a destructor or a callback of an extension it would be lost.
        self._interrupted = number
        interrupt(number, frame)

    def start_node(self, name: str, parameters: Mapping[str, object]) -> None:
        """Start one of our nodes with ROS parameters."""
        arguments = [text for key, value in parameters.items()
                     for text in ('-p', f'{key}:={_ros_value(value)}')]
        self.start(name, [sys.executable, '-m', f'{name}.node', '--ros-args', *arguments])

    def start(self, name: str, command: Sequence[str]) -> None:
        """Start a process; its output goes to ``<name>.log``."""
        with self.log(name).open('ab') as log:
            self._running[name] = subprocess.Popen(
                list(command), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
                env=self._environment, start_new_session=True,
                # No other thread runs here that could hold a lock at the fork.
                preexec_fn=_child_of(os.getpid()))  # noqa: PLW1509

    @property
    def pids(self) -> dict[str, int]:
        """Return the process id of every child by its name."""
        return {name: child.pid for name, child in self._running.items()}

    def log(self, name: str) -> Path:
        """Return where a child's output goes."""
        return self.folder / f'{name}.log'

    def check(self) -> None:
        """
        Check that every child still runs.

        Raises
        ------
        UserError
            If one has ended; with the last line it said.
        Stopped
            If somebody pressed Ctrl-C, or the like.

        """
        if self._interrupted:
            raise Stopped(self._interrupted)
        for name, child in self._running.items():
            if child.poll() is not None:
                lines = self.log(name).read_text(errors='replace').strip().splitlines()
                raise UserError(f'{name} ended with code {child.returncode}: '
                                f'{lines[-1] if lines else "it said nothing"} '
                                f'(see {self.log(name)})')

    def stop(self) -> None:
        """Interrupt every child, and kill those that do not end in time."""
        children = list(self._running.values())
        for child in children:
            _send(child, signal.SIGINT)
        deadline = time.monotonic() + PATIENCE
        for child in children:
            try:
                child.wait(max(deadline - time.monotonic(), 0.1))
            except subprocess.TimeoutExpired:
                _send(child, signal.SIGKILL)
                child.wait()
        self._running.clear()


def _send(child: 'subprocess.Popen[bytes]', number: signal.Signals) -> None:
    with suppress(ProcessLookupError):
        child.send_signal(number)


def _child_of(parent: int) -> Callable[[], None]:
    """Return a function that lets a child receive SIGINT again and end with its parent."""
    libc = ctypes.CDLL(None) if sys.platform == 'linux' else None

    def prepare() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        if libc is not None:
            libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
            if os.getppid() != parent:
                os._exit(1)

    return prepare


def _ros_value(value: object) -> str:
    """Write a parameter's value as ROS reads it from the command line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    return repr(value)


@contextmanager
def own_domain() -> Iterator[dict[str, str]]:
    """
    Return the environment of a ROS domain on this machine that nobody else uses.

    A domain that the user has set is kept. Meanwhile this process's own nodes are not found from
    other machines either, whatever the user has set: what drives a simulated robot must not
    drive a real one.
    """
    with _variables(_THIS_MACHINE):
        if os.environ.get('ROS_DOMAIN_ID'):
            yield dict(_THIS_MACHINE)
            return
        with free_domain() as domain:
            yield {**_THIS_MACHINE, 'ROS_DOMAIN_ID': str(domain)}


@contextmanager
def _variables(values: Mapping[str, str]) -> Iterator[None]:
    """Set variables of this process's environment, and put back what was there."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def free_domain() -> Iterator[int]:
    """
    Hold a ROS_DOMAIN_ID that nobody else on this machine holds.

    A locked file stands for a domain; the kernel drops the lock when its process ends, however.
    """
    folder = Path(tempfile.gettempdir()) / f'experience_controller_domains_{os.getuid()}'
    check_folder(folder)
    folder.mkdir(0o700, exist_ok=True)
    first = os.getpid() % len(DOMAINS)
    for domain in DOMAINS[first:] + DOMAINS[:first]:
        with os.fdopen(open_lock(folder / str(domain)), 'rb') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield domain
            return
    raise UserError(f'all {len(DOMAINS)} ROS domains are in use (see {folder}), '
                    f'set ROS_DOMAIN_ID to one of your own')
