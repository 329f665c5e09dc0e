"""
Processes that have imported what our programs need before they begin.

``python forks.py MODULE ARGUMENT...`` runs the `main` of a module. A process of a test that does
so is forked from a server, one for each worker of the tests, in which all libraries are loaded:
to load them takes longer than most of what a node does in a test. It is a process like others,
with a session, an environment, signals and an end of its own; only its beginning is another one,
so what tests that beginning starts Python itself.
"""

from collections.abc import Mapping, Sequence
import gc
from importlib import import_module
import json
import os
from pathlib import Path
import select
import selectors
import subprocess
import sys
import time
from typing import Any

#: The modules whose imports are done in advance.
PROGRAMS = (
    'sim_node.node', 'control_field_node.node', 'learner_node.node', 'teleop_node.node',
    'neighbourhood_node.node', 'localised_odometry_node.node', 'page_node.node',
    'experience_cli.main')


def command(module: str, *arguments: str) -> list[str]:
    """Return the command that runs the `main` of a module."""
    return [sys.executable, __file__, module, *arguments]


def is_forkable(words: Sequence[str], env: Mapping[str, str] | None) -> bool:
    """Return True for such a command, if Python itself does not begin in another way for it."""
    return list(words[:2]) == command('')[:2] and words[2] in PROGRAMS and not any(
        name.startswith(('PYTHON', 'LD_')) for name in env or ())


class Forked:
    """A process of the server's, with what is used of `subprocess.Popen`."""

    def __init__(self, server: 'Server', pid: int) -> None:
        self.pid, self.returncode = pid, None
        self._server = server

    def poll(self) -> int | None:
        """Return its exit code if it has ended."""
        if self.returncode is None:
            self._server.listen(0.0)
            self.returncode = self._server.codes.pop(self.pid, None)
        return self.returncode

    def wait(self, timeout: float = float('inf')) -> int:
        """Return its exit code when it has ended."""
        end = time.monotonic() + timeout
        while (code := self.poll()) is None:
            left = end - time.monotonic()
            if left < 0.0:
                raise subprocess.TimeoutExpired(str(self.pid), timeout)
            self._server.listen(min(left, 1.0))
        return code

    def send_signal(self, number: int) -> None:
        """Send it a signal, unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)


class Server:
    """The server, as its client sees it; it ends with the client."""

    def __init__(self, env: Mapping[str, str]) -> None:
        self._server = subprocess.Popen(
            [sys.executable, __file__, '--serve'], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env=env, start_new_session=True, bufsize=0)
        #: Of processes that have ended, and that nobody has asked for.
        self.codes: dict[int, int] = {}
        self._started: list[int] = []
        self._heard = b''

    def end(self) -> None:
        """Let it end, as it does by itself where this process is killed."""
        self._server.stdin.close()
        self._server.wait()
        self._server.stdout.close()

    def start(self, words: Sequence[str], files: Sequence[Path | str], cwd: Path,
              env: Mapping[str, str]) -> Forked:
        """Start a process with these standard files; a terminal among them controls it."""
        request = {'words': list(words[2:]), 'files': [str(path) for path in files],
                   'cwd': str(cwd), 'env': dict(env)}
        self._server.stdin.write(json.dumps(request).encode() + b'\n')
        while not self._started:
            self.listen(60.0)
        pid = self._started.pop()
        self.codes.pop(pid, None)
        return Forked(self, pid)

    def listen(self, seconds: float) -> None:
        """Note what has started and ended; wait so long for it."""
        if not select.select([self._server.stdout], [], [], seconds)[0]:
            return
        said = os.read(self._server.stdout.fileno(), 65536)
        if not said:
            raise RuntimeError(f'the server of processes ended with {self._server.wait()}')
        *lines, self._heard = (self._heard + said).split(b'\n')
        for pid, code in map(json.loads, lines):
            if code is None:
                self._started.append(pid)
            else:
                self.codes[pid] = code


def serve() -> list[str]:
    """Fork a process for every line that comes; return in each of them, with its words."""
    for module in PROGRAMS:
        import_module(module)
    gc.freeze()
    with selectors.DefaultSelector() as selector:
        selector.register(0, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                if key.data is not None:
                    selector.unregister(key.fd)
                    os.close(key.fd)
                    tell(key.data, os.waitstatus_to_exitcode(os.waitpid(key.data, 0)[1]))
                    continue
                request = read_line()
                if not request:
                    os._exit(0)
                pid = fork()
                if pid == 0:
                    for other in selector.get_map().values():
                        if other.data is not None:
                            os.close(other.fd)
                    return become(**json.loads(request))
                selector.register(os.pidfd_open(pid), selectors.EVENT_READ, pid)
                tell(pid, None)


def read_line() -> bytes:
    """Return the line that has come, or is coming; nothing at the end."""
    line = b''
    while not line.endswith(b'\n') and (part := os.read(0, 65536)):
        line += part
    return line


def tell(pid: int, code: int | None) -> None:
    """Say that a process has started, or how it has ended."""
    os.write(1, json.dumps([pid, code]).encode() + b'\n')


def fork() -> int:
    """Fork a process that leads a session when this returns."""
    ours, theirs = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.setsid()
        os.close(ours)
        os.close(theirs)
        return 0
    os.close(theirs)
    os.read(ours, 1)
    os.close(ours)
    return pid


def become(words: list[str], files: list[str], cwd: str, env: dict[str, str]) -> list[str]:
    """Make this process the one that was asked for; return its words."""
    for number, path in enumerate(files):
        opened = os.open(path, os.O_RDWR)
        os.dup2(opened, number)
        os.close(opened)
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    return words


def run(module: str, *arguments: str) -> Any:
    """Run the `main` of a module."""
    sys.argv = [module, *arguments]
    return import_module(module).main()


if __name__ == '__main__':
    sys.exit(run(*(serve() if sys.argv[1:] == ['--serve'] else sys.argv[1:])))
