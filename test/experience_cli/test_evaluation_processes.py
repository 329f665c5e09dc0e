"""The processes of an evaluation end with it, however it ends."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

ROOT = Path(__file__).resolve().parents[2]


def children_of(pid):
    """Return the living children of a process."""
    found = []
    for entry in Path('/proc').iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / 'stat').read_text().rsplit(')', 1)[1].split()
            except OSError:
                continue
            if int(fields[1]) == pid and fields[0] != 'Z':
                found.append(int(entry.name))
    return found


def wait_for(condition, seconds):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def is_gone(pid):
    try:
        return (Path('/proc') / str(pid) / 'stat').read_text().rsplit(')', 1)[1].split()[0] == 'Z'
    except OSError:
        return True


@pytest.mark.skipif(not Path('/proc').is_dir(), reason='looks for processes in /proc')
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_is_left_behind(number, tmp_path):
    path = tmp_path / 'open.map'
    path.write_text('type octile\nheight 40\nwidth 40\nmap\n' + ('.' * 40 + '\n') * 40)
    process = subprocess.Popen(
        [sys.executable, '-m', 'experience_cli.main', 'evaluate', '--world', str(path), '--goal',
         '30.5,30.5', '--demo-start', '1.5,1.5', '--trials', '200', '--seeds', '50', '--jobs',
         '2', '--profile', 'paper'],
        cwd=ROOT, env={**os.environ, 'PYTHONPATH': str(ROOT)}, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
        # A shell's background jobs ignore SIGINT, and so would what they start.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))  # noqa: PLW1509
    # Two that work and multiprocessing's own tracker of resources.
    wait_for(lambda: len(children_of(process.pid)) >= 3, 60.0)
    children = children_of(process.pid)
    process.send_signal(number)
    _, error = process.communicate(timeout=30.0)
    if number == signal.SIGINT:
        assert (process.returncode, error) == (130, 'experience evaluate: stopped\n')
    wait_for(lambda: all(is_gone(child) for child in children), 15.0)
