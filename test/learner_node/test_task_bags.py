"""The bags of a task as files: how many there are, and one by its name."""

import os
import time

import pytest

from bridge_helpers import demonstration_bag
from episode_store.errors import NothingThereError
from episode_store.task_folder import TaskFolder
from episode_store.undo import bring_back, take_away
from learner_node.learning.task_bags import bag_named, BagCounts


@pytest.fixture
def task(tmp_path):
    demonstration_bag(tmp_path)
    demonstration_bag(tmp_path)
    return TaskFolder(tmp_path, 'task1')


def test_bags_are_counted_as_they_come_and_go(task):
    counts = BagCounts()
    assert counts.of(task) == {'episodes': '2', 'can_undo': 'false'}
    take_away(task, [1])
    assert counts.of(task) == {'episodes': '1', 'can_undo': 'true'}
    bring_back(task)
    assert counts.of(task) == {'episodes': '2', 'can_undo': 'false'}
    other = TaskFolder(task.root, 'other')
    assert counts.of(other) == {'episodes': '0', 'can_undo': 'false'}
    assert counts.of(task)['episodes'] == '2'


def test_a_folder_that_has_not_changed_is_not_read_again(task, monkeypatch):
    counts = BagCounts()
    take_away(task, [1])
    long_ago = time.time() - 60.0
    for folder in (task.path, task.path / '.forgotten'):
        os.utime(folder, (long_ago, long_ago))
    counts.of(task)
    monkeypatch.setattr(TaskFolder, 'episodes', lambda self: pytest.fail('it was read again'))
    assert counts.of(task) == {'episodes': '1', 'can_undo': 'true'}


def test_a_folder_that_cannot_be_read_says_what_was_known(task):
    counts = BagCounts()
    counts.of(task)
    twin = task.path / '0001_trial'
    twin.mkdir()  # two bags of one number
    assert counts.of(task)['episodes'] == '2'


@pytest.mark.parametrize('name', ['0003_demo', '0001_trial', '../task1', '/', '0001', 'x' * 300])
def test_a_bag_that_is_not_there_is_not_found(task, name):
    with pytest.raises(NothingThereError, match='there is no bag'):
        bag_named(task, name)


def test_a_bag_is_found_by_its_name_or_as_the_newest(task):
    assert bag_named(task, '0001_demo').number == 1
    assert bag_named(task, '').number == 2
    with pytest.raises(NothingThereError):
        bag_named(TaskFolder(task.root, 'other'), '')
