"""The processes of an evaluation end with it, however it ends."""

import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

from experience_evaluation.workers import LostError, run, run_all
from ros_helpers import hearing_hangups

ROOT = Path(__file__).resolve().parents[2]


needs_proc = pytest.mark.skipif(not Path('/proc').is_dir(), reason='looks for processes in /proc')


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


def started(folder, size, *options):
    """Start an evaluation of an open world."""
    path = folder / 'open.map'
    row = '.' * size + '\n'
    path.write_text(f'type octile\nheight {size}\nwidth {size}\nmap\n' + row * size)
    return subprocess.Popen(
        [sys.executable, '-m', 'experience_cli.main', 'evaluate', '--world', str(path), '--goal',
         '8.5,8.5', '--demo-start', '1.5,1.5', '--profile', 'paper', *options],
        cwd=ROOT, env={**os.environ, 'PYTHONPATH': str(ROOT)}, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
        # A shell's background jobs ignore SIGINT, and so would what they start.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))  # noqa: PLW1509


@needs_proc
@pytest.mark.parametrize('number', [
    signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_no_process_is_left_behind(number, tmp_path):
    with hearing_hangups():
        process = started(tmp_path, 40, '--trials', '200', '--seeds', '50', '--jobs', '2')
    # Two that work and multiprocessing's own tracker of resources.
    wait_for(lambda: len(children_of(process.pid)) >= 3, 60.0)
    children = children_of(process.pid)
    process.send_signal(number)
    _, error = process.communicate(timeout=30.0)
    if number == signal.SIGKILL:
        assert error == ''
    else:
        assert (process.returncode, error) == (128 + number, 'experience evaluate: stopped\n')
    wait_for(lambda: all(is_gone(child) for child in children), 15.0)


def workers_of(pid):
    """Return the children that work: one more keeps count of resources."""
    return [child for child in children_of(pid)
            if b'spawn_main' in (Path('/proc') / str(child) / 'cmdline').read_bytes()]


def without_seconds(text):
    """Return a report without the one number that differs from run to run."""
    report = json.loads(text)
    for entry in report['after']:
        entry.pop('seconds_learning')
    return report


@needs_proc
def test_a_killed_process_changes_nothing_in_the_report(tmp_path):
    options = ('--trials', '1', '--seeds', '2', '--json', '-')
    process = started(tmp_path, 10, *options, '--jobs', '2')
    wait_for(lambda: len(workers_of(process.pid)) == 2, 60.0)
    os.kill(workers_of(process.pid)[0], signal.SIGKILL)
    text, error = process.communicate(timeout=120.0)
    assert process.returncode == 0, error
    assert 'a working process was killed' in error
    assert 'Traceback' not in error
    whole, _ = started(tmp_path, 10, *options).communicate(timeout=120.0)
    assert without_seconds(text) == without_seconds(whole)


#: Work that does nothing, and work that is killed.
HARMLESS, DEADLY = (int(signal.SIGWINCH),), (int(signal.SIGKILL),)


def test_what_always_dies_takes_nothing_else_with_it():
    said = []
    done = dict(run(signal.raise_signal, [HARMLESS, DEADLY, HARMLESS], 2, said.append))
    assert sorted(done) == [0, 2]
    assert ['killed' in line for line in said] == [True]


def test_many_that_die_take_nothing_else_with_them():
    tasks = [HARMLESS, DEADLY, DEADLY, HARMLESS, HARMLESS, HARMLESS, DEADLY, HARMLESS]
    done = dict(run(signal.raise_signal, tasks, 2, lambda line: None))
    assert sorted(done) == [0, 3, 4, 5, 7]


def test_what_is_lost_is_named(monkeypatch):
    monkeypatch.setattr('experience_evaluation.workers.run_seed', signal.raise_signal)
    with pytest.raises(LostError) as caught:
        run_all([HARMLESS, DEADLY], 2, 'test')
    assert caught.value.lost == (1,)
    assert len(caught.value.curves) == 1
