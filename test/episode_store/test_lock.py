"""A task's folder belongs to one learner, or to one command that changes it, at a time."""

import os
from pathlib import Path
import signal
import subprocess
import sys

import pytest

from bridge_helpers import demonstration_bag
from episode_store.lock import changing, is_in_use
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder

HOLD = """
import sys, time
from pathlib import Path
from episode_store.task_folder import TaskFolder
TaskFolder(Path(sys.argv[1]), 'task').hold()
print('held', flush=True)
sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    (tmp_path / 'task').mkdir()
    process = subprocess.Popen([sys.executable, '-c', HOLD, str(tmp_path)],
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == 'held\n'
    yield process
    process.kill()
    process.communicate()


def n_open():
    """Return how many files this process has open."""
    return len(list(Path('/proc/self/fd').iterdir()))


def change(folder):
    with changing(folder):
        pass


def test_a_second_learner_and_a_change_are_refused_in_words(holder, tmp_path):
    assert is_in_use(tmp_path / 'task')
    before = n_open()
    for attempt in (TaskFolder(tmp_path, 'task').hold, lambda: change(tmp_path / 'task')):
        with pytest.raises(BagError, match='is in use by a learner that is running'):
            attempt()
    assert n_open() == before


def test_a_kill_lets_go(holder, tmp_path):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    change(tmp_path / 'task')
    TaskFolder(tmp_path, 'task').hold()


def test_a_folder_nobody_ever_held_is_free(tmp_path):
    change(tmp_path)
    assert not is_in_use(tmp_path)
    assert not is_in_use(tmp_path / 'nowhere')
    change(tmp_path / 'nowhere')
    assert not (tmp_path / 'nowhere').exists()


def test_no_learner_starts_while_a_command_changes_bags(tmp_path):
    folder = tmp_path / 'task'
    folder.mkdir()
    with changing(folder):
        assert is_in_use(folder)
        held = subprocess.run([sys.executable, '-c', HOLD, str(tmp_path)], check=False,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True)
        assert 'a command that changes bags' in held.stderr
    assert not is_in_use(folder)
    TaskFolder(tmp_path, 'task').hold()


def test_a_folder_made_for_a_bag_goes_if_none_comes(tmp_path):
    with pytest.raises(BagError), changing(tmp_path / 'bags' / 'task', make=True):
        raise BagError('nothing to learn from it')
    assert not (tmp_path / 'bags' / 'task').exists()
    with changing(tmp_path / 'bags' / 'task1', make=True):
        demonstration_bag(tmp_path / 'bags')
    assert len(TaskFolder(tmp_path / 'bags', 'task1').episodes()) == 1


def test_what_could_not_be_deleted_of_a_bag_goes_at_the_next_chance(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    left = [task.path / f'.removed-0001_demo-{name}' for name in 'ab']
    for path, hold in zip(left, (task.hold, lambda: change(task.path)), strict=True):
        path.mkdir(parents=True)
        (path / 'x.mcap').touch()
        if path == left[1]:
            os.close(task._held)
        hold()
        assert not path.exists()


def test_a_task_that_was_set_aside_is_held_anew(tmp_path):
    demonstration_bag(tmp_path)
    task = TaskFolder(tmp_path, 'task1')
    task.hold()
    task.path.rename(tmp_path / 'before')
    before = n_open()
    task.hold()
    assert n_open() == before
    assert is_in_use(task.path)
    assert not is_in_use(tmp_path / 'before')
