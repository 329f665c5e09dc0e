"""A real process on a pseudo-terminal: type keys, look at what it shows."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
import fcntl
import os
from pathlib import Path
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time

import forks
import ros_helpers


class TerminalProcess(ros_helpers.Process):
    """A child whose standard input and output are a terminal of its own, which controls it."""

    def __init__(
        self, command: Sequence[str], folder: Path, env: Mapping[str, str] | None = None,
        width: int = 80, name: str = 'terminal',
    ) -> None:
        self.name = name
        self._stdout = self._stderr = folder / f'{name}_{time.monotonic_ns()}.err'
        self.master, self.slave = pty.openpty()
        self.resize(width)
        self.shown = ''
        self.before = self.mode()
        ros_helpers.listen_to_interrupts()

        def control() -> None:
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

        environment = ros_helpers.child_environment(env)
        with self._stderr.open('wb') as err:
            if forks.is_forkable(command, env):
                terminal = os.ttyname(self.slave)
                self.popen = ros_helpers.fork_server().start(
                    command, (terminal, terminal, self._stderr), ros_helpers.ROOT, environment)
            else:
                self.popen = subprocess.Popen(
                    list(command), stdin=self.slave, stdout=self.slave, stderr=err,
                    cwd=ros_helpers.ROOT, env=environment, start_new_session=True,
                    preexec_fn=control)  # noqa: PLW1509 - it makes one system call and no more

    @property
    def stdout(self) -> str:
        """What it has shown so far."""
        return self.read()

    def resize(self, width: int) -> None:
        """Set the number of columns."""
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack('HHHH', 24, width, 0, 0))

    def read(self) -> str:
        """Take in what it shows and return all of it."""
        while select.select([self.master], [], [], 0.0)[0]:
            with suppress(OSError):
                data = os.read(self.master, 65536)
                self.shown += data.decode(errors='replace')
                if data:
                    continue
            break
        return self.shown

    def type(self, keys: str) -> None:
        """Type keys."""
        os.write(self.master, keys.encode())

    def paste(self, data: bytes) -> None:
        """Let bytes come as if they were typed; waits until the terminal has room for them."""
        while data:
            data = data[os.write(self.master, data):]

    @property
    def is_read(self) -> bool:
        """Whether what was typed has all been read."""
        return struct.unpack('i', fcntl.ioctl(self.slave, termios.FIONREAD, bytes(4)))[0] == 0

    def lines(self) -> list[str]:
        """Return every line and every state of the status line it has shown."""
        text = re.sub(r'\x1b\[K', '', self.read())
        return [line for line in re.split(r'[\r\n]+', text) if line]

    def mode(self) -> list:
        """Return how the terminal is set."""
        return termios.tcgetattr(self.slave)

    def close(self) -> None:
        """Let the terminal go."""
        for descriptor in (self.master, self.slave):
            with suppress(OSError):
                os.close(descriptor)

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if kind is None and self.running:
            self.stop(signal.SIGTERM)
        self.kill()
        self.close()
