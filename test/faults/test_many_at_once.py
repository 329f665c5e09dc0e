"""Many bags, many demonstrations, and several commands at once on one task."""

import os
from pathlib import Path
import re
import resource
import subprocess
import sys

import pytest

from bridge_helpers import demonstration_bag, GRID
from control_field.parameters import Parameters
from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.repair import repair_task
from episode_store.rosbag2.errors import mcap_path
from episode_store.task_folder import EpisodeKind, TaskFolder
from experience_cli.main import main
from ros_helpers import child_environment
from sample_helpers import field_of, sample_copy


def copies(root, n):
    """Return a task of n demonstrations that are one and the same file."""
    first = demonstration_bag(root, 60, 5.0)
    for number in range(2, n + 1):
        folder = first.with_name(f'{number:04d}_demo')
        folder.mkdir()
        os.link(first / 'metadata.yaml', folder / 'metadata.yaml')
        os.link(mcap_path(first), mcap_path(folder))
    return TaskFolder(root, 'task1')


@pytest.fixture
def few_files():
    """Let this process open few files at a time: who leaves some open runs out of them."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    n_open = len(list(Path('/proc/self/fd').iterdir()))
    resource.setrlimit(resource.RLIMIT_NOFILE, (n_open + 60, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_a_learner_begins_with_two_thousand_bags(tmp_path, few_files):
    task = copies(tmp_path, 2000)
    task.hold()
    assert repair_task(task) == []
    assert task.new_episode(EpisodeKind.TRIAL).number == 2001
    assert task.forget(1000).is_forgotten
    assert task.recall(1000).number == 1000


def test_hundreds_of_bags_are_listed(tmp_path, few_files, capsys):
    task = copies(tmp_path, 200)
    assert main(['list', str(task.path)]) == 0
    lines = capsys.readouterr().out.splitlines()[1:201]
    assert {line.split()[2] for line in lines} == {'kept'}


def test_a_hundred_demonstrations_are_learnt(tmp_path):
    relearner = Relearner(GRID, Parameters())
    for episode in copies(tmp_path, 100).episodes():
        assert relearner.learn(Episode(episode)).refresh is not None
    assert relearner.refresh.field.revision == 100


def test_five_commands_at_once_leave_every_bag_whole(tmp_path):
    task = sample_copy(tmp_path)
    before = field_of(task)
    commands = [['label', 'sample/0002', 'failure'], ['label', 'sample/0003', 'success'],
                ['forget', 'sample/0003'], ['repair', 'bags/sample'], ['list']]
    running = [subprocess.Popen(
        [sys.executable, '-m', 'experience_cli.main', *command], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=child_environment())
        for command in commands]
    for process in running:
        _, err = process.communicate(timeout=120)
        assert process.returncode in (0, 2), err
        assert 'Traceback' not in err
        if process.returncode:
            assert re.search(r'in use|was forgotten|there is no bag', err), err
    assert sorted(each.number for each in [*task.episodes(), *task.forgotten()]) == [1, 2, 3]
    assert all(Episode(each).is_closed for each in [*task.episodes(), *task.forgotten()])
    for number in [each.number for each in task.forgotten()]:
        task.recall(number)
    for number in (2, 3):
        assert main(['label', f'sample/{number:04d}', 'none', '--bags', str(task.root)]) == 0
    assert field_of(task) == before
