"""
Commands on a disk that has room for so much and no more, for more and more room.

Run as a script, so that nothing has started a thread before it forks:
``python full_disk.py HOW SOURCE SCRATCH COMMANDS``. HOW is ``disk``, a small file system that is
mounted on SCRATCH (in a mount namespace of its own), or ``limit``: no file may grow beyond the
room. Commands are words in JSON, in which ``{}`` is a fresh copy, below SCRATCH, of
the folder SOURCE. Prints, as JSON, how each run of each command ended and what was there then.
"""

import hashlib
import json
import os
from pathlib import Path
import resource
import shutil
import subprocess
import sys

from experience_cli.commands import (  # noqa: F401
    evaluate, forget, inspect_field, label, learn, repair, trim)
from experience_cli.main import main as experience

#: A block of the small file system, and how many there are.
BLOCK, N_BLOCKS = 4096, 1024
#: Blocks of room that are tried: none, for one file or two, for a part of what is large, for all.
ROOMS = (0, 1, 2, 3, 30, 70, 300)


def files_in(root: Path) -> dict[str, str]:
    """Return what every file is, by its name, but for the locks."""
    return {str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest()[:16]
            for path in sorted(root.rglob('*'))
            if path.is_file() and path.name not in ('.lock', '.in_use')}


def fill(scratch: Path, room: int) -> Path:
    """Leave room for so many blocks on the disk; return the file that fills it."""
    rest = scratch / 'rest'
    free = os.statvfs(scratch).f_bavail
    with rest.open('wb') as file:
        file.write(bytes(max(free - room, 0) * BLOCK))
    return rest


def run(command: list[str], limit: int | None) -> tuple[int, str]:
    """Run a command in a child; return how it ended and what it said on stderr."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        code = 99
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(writing, 2)
            if limit is not None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            code = experience(command)
        finally:
            sys.stderr.flush()
            os._exit(code)
    os.close(writing)
    with os.fdopen(reading, errors='replace') as pipe:
        said = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said


def rounds_of(
    how: str, source: Path, scratch: Path, command: list[str],
) -> list[dict[str, object]]:
    """Run a command with more and more room, until it has enough."""
    rounds: list[dict[str, object]] = []
    for room in ROOMS:
        root = scratch / 'root'
        shutil.rmtree(root, ignore_errors=True)
        shutil.copytree(source, root)
        before = files_in(root)
        rest = fill(scratch, room) if how == 'disk' else None
        code, text = run([word.format(root) for word in command],
                         room * BLOCK if how == 'limit' else None)
        if rest is not None:
            rest.unlink()
        rounds.append({'room': room, 'code': code, 'said': text,
                       'before': before, 'after': files_in(root)})
        if code == 0:
            break
    return rounds


def main() -> None:
    """Run the commands."""
    how, source, scratch = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    if how == 'disk':
        subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={N_BLOCKS * BLOCK}', 'tmpfs',
                        str(scratch)], check=True)
    print(json.dumps([rounds_of(how, source, scratch, command)
                      for command in json.loads(sys.argv[4])]))


if __name__ == '__main__':
    main()
