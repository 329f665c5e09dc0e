"""A task's folder belongs to one learner at a time."""

import os
import signal
import subprocess
import sys

import pytest

from msgs_bridge.bag_folder import BagError, check_unused, is_in_use, TaskFolder

HOLD = """
import sys, time
from pathlib import Path
from msgs_bridge.bag_folder import TaskFolder
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


def test_a_second_learner_and_a_change_are_refused_in_words(holder, tmp_path):
    assert is_in_use(tmp_path / 'task')
    for attempt in (TaskFolder(tmp_path, 'task').hold, lambda: check_unused(tmp_path / 'task')):
        with pytest.raises(BagError, match='is in use by a learner that is running'):
            attempt()


def test_a_kill_lets_go(holder, tmp_path):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    check_unused(tmp_path / 'task')
    TaskFolder(tmp_path, 'task').hold()


def test_a_folder_nobody_ever_held_is_free(tmp_path):
    check_unused(tmp_path)
    assert not is_in_use(tmp_path / 'nowhere')
