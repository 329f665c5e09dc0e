"""
A command that is stopped at its n-th file operation, for every n.

Run as a script, so that nothing has started a thread before it forks:
``python stop_commands.py SOURCE SCRATCH COMMANDS``, the last in JSON: how (kill or interrupt) and
words, in which ``{}`` is a fresh copy, SCRATCH, of the folder SOURCE, each time. Prints, as JSON,
what the bags of all tasks in it are after each stop.
"""

from collections.abc import Callable
import json
import os
from pathlib import Path
import shutil
import signal
import sys

from episode_store.episode import Episode
from episode_store.lock import changing
from episode_store.rosbag2 import writer as bag_file
from episode_store.summary import summary_of
from episode_store.task_folder import TaskFolder
from experience_cli.commands import (  # noqa: F401 - so that no child has to load them
    forget, label, learn, repair, trim)
from experience_cli.main import main as experience

#: Audit events that change files; `os.write` and the like raise none, and are wrapped.
_CHANGES = {'os.rename', 'os.mkdir', 'os.remove', 'os.rmdir', 'os.link', 'os.truncate'}
_SILENT = ('write', 'fsync', 'ftruncate')


def state_of(root: Path) -> dict[str, str]:
    """Say what every bag in a folder of tasks holds, those forgotten among them."""
    found = {}
    for task in sorted(path.name for path in root.iterdir() if path.name[0] != '.'):
        folder = TaskFolder(root, task)
        for episode in [*folder.episodes(), *folder.forgotten()]:
            about = summary_of(Episode(episode))
            found[str(episode.path.relative_to(root))] = (
                f'{about.state} {about.messages} {about.duration} {about.cells} {about.label}')
    return found


def _stop_at(number: int, how: str, root: str) -> None:
    """Stop this process just before its n-th operation on files in a folder."""
    count = 0

    def operation(is_open: bool = True) -> None:
        nonlocal count
        if not count and not is_open:
            return
        count += 1
        if count == number:
            if how == 'kill':
                os.kill(os.getpid(), signal.SIGKILL)
            raise KeyboardInterrupt

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        writes = event == 'open' and int(str(arguments[2])) & (os.O_WRONLY | os.O_RDWR)
        if (writes or event in _CHANGES) and str(arguments[0]).startswith(root):
            operation()

    for name in _SILENT:
        setattr(os, name, _wrapped(getattr(os, name), lambda: operation(is_open=False)))
    sys.addaudithook(hook)


def _wrapped(call: Callable[..., object], before: Callable[[], None]) -> Callable[..., object]:
    def wrapped(*arguments: object) -> object:
        before()
        # A stopped process loses nothing the system has; to wait for disks takes minutes.
        return None if call.__name__ == 'fsync' else call(*arguments)
    return wrapped


def _run(command: list[str], number: int, how: str, root: Path) -> int:
    """Run a command in a child that is stopped; return how it ended."""
    child = os.fork()
    if child == 0:
        code = 99
        try:
            silence = os.open(os.devnull, os.O_WRONLY)
            for stream in (1, 2):
                os.dup2(silence, stream)
            _stop_at(number, how, str(root))
            code = experience(command)
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _stopped_everywhere(
    source: Path, root: Path, command: list[str], how: str,
) -> dict[str, object]:
    """Return the states of the bags after every stop, what was left lying about, and the end."""
    afterwards: list[dict[str, str]] = []
    left: list[str] = []
    while True:
        shutil.rmtree(root, ignore_errors=True)
        shutil.copytree(source, root)
        code = _run([word.format(root) for word in command], len(afterwards) + 1, how, root)
        states = state_of(root)
        if code == 0:
            return {'afterwards': afterwards, 'left': left, 'done': states}
        if code != (-signal.SIGKILL if how == 'kill' else 130):
            raise SystemExit(f'{command}: operation {len(afterwards) + 1}: exit code {code}')
        afterwards.append(states)
        for task in root.iterdir():
            with changing(task):
                left += [str(path) for path in task.iterdir()
                         if path.is_dir() and path.name[0] == '.' and path.name != '.forgotten']


def main() -> None:
    """Stop the commands at every operation."""
    # A few large chunks: every one of them is a file operation like the others.
    bag_file.CHUNK_BYTES, bag_file.CHUNK_SECONDS = 100_000, 60.0  # type: ignore[misc]
    source, scratch = map(Path, sys.argv[1:3])
    print(json.dumps([_stopped_everywhere(source, scratch, command, how)
                      for how, command in json.loads(sys.argv[3])]))


if __name__ == '__main__':
    main()
