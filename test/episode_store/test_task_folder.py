"""Names and numbers of bags; a slip in the name of a task is noticed."""

from concurrent.futures import ThreadPoolExecutor
import os
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import pytest

from bridge_helpers import demonstration_bag, refusal, run_python
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import (
    check_task_name, episode_from_path, EpisodeKind, TaskFolder, tasks)
from msgs_bridge.node.close_names import close_name, distance
import ros_helpers

MANY = """
import sys
from episode_store.task_folder import TaskFolder
for i in range(20):
    print(TaskFolder(sys.argv[1], 'task1').new_episode(('demo', 'trial')[i % 2]).path.name)
"""

words = st.text('abc', max_size=7)


def test_numbers_count_both_kinds_from_one(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    assert task.episodes() == []
    made = [task.new_episode(kind) for kind in ('demo', 'trial', EpisodeKind.TRIAL, 'demo')]
    assert [episode.path.name for episode in made] == [
        '0001_demo', '0002_trial', '0003_trial', '0004_demo']
    assert task.episodes() == made
    assert made[1].name == 'task1/0002'
    assert made[1].bag.name == '0002_trial_0.mcap'
    assert task.find(3) == made[2]
    assert episode_from_path(made[3].path) == made[3]


def test_two_processes_never_get_the_same_number(tmp_path):
    with ThreadPoolExecutor(3) as pool:
        ran = list(pool.map(lambda _: run_python(MANY, str(tmp_path)), range(3)))
    assert [run.stderr for run in ran] == [''] * 3
    numbers = sorted(int(name[:4]) for run in ran for name in run.stdout.split())
    assert numbers == list(range(1, 61))
    assert len(TaskFolder(tmp_path, 'task1').episodes()) == 60


@pytest.mark.parametrize('name', [
    '..', '.', '', '/', 'a/b', '../x', 'a b', 'ä', 'x' * 65, 'a\0', 'a\n', '~', None, 7], ids=repr)
def test_a_task_cannot_escape(name, tmp_path):
    with pytest.raises(BagError, match=r'task is .* must be 1 to 64 letters'):
        TaskFolder(tmp_path, name)


@given(st.text(max_size=10))
def test_a_task_name_is_one_plain_folder(name):
    if not refusal(lambda: check_task_name(name), BagError):
        assert Path('/bags', name).parent == Path('/bags')
        assert os.path.normpath(f'/bags/{name}') == f'/bags/{name}'


def test_a_link_that_leads_out_is_refused(tmp_path):
    outside = tmp_path / 'outside'
    outside.mkdir()
    (tmp_path / 'bags').mkdir()
    (tmp_path / 'bags' / 'task1').symlink_to(outside)
    with pytest.raises(BagError, match='leads out of'):
        TaskFolder(tmp_path / 'bags', 'task1')


def test_other_files_are_passed_over(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    kept = task.new_episode('demo')
    (task.path / 'README.md').touch()
    (task.path / '0009_demo').touch()
    (task.path / '0007_note').mkdir()
    (task.path / '0008_demo').symlink_to(kept.path)
    assert task.episodes() == [kept]
    assert task.new_episode('trial').number == 2


def test_two_bags_of_one_number_are_refused(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    for name in ('0001_demo', '0001_trial'):
        (task.path / name).mkdir(parents=True)
    with pytest.raises(BagError, match=r'0001_demo and .*0001_trial have the same number'):
        task.episodes()


def test_a_bag_that_is_not_there(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    with pytest.raises(BagError, match='there is no bag 0003 in'):
        task.find(3)
    with pytest.raises(BagError, match='must be named like 0001_demo'):
        episode_from_path(tmp_path)


def test_a_bag_is_removed_whole(tmp_path):
    task = TaskFolder(tmp_path, 'task1')
    first, second = task.new_episode('demo'), task.new_episode('trial')
    second.bag.touch()
    task.remove(2)
    assert task.episodes() == [first]
    assert sorted(path.name for path in task.path.iterdir()) == ['.lock', '0001_demo']
    assert task.new_episode('trial').number == 2


def test_tasks_are_listed(tmp_path):
    assert tasks(tmp_path / 'none') == []
    TaskFolder(tmp_path, 'b').new_episode('demo')
    TaskFolder(tmp_path, 'a').new_episode('demo')
    (tmp_path / 'empty').mkdir()
    (tmp_path / 'file').touch()
    assert tasks(tmp_path) == ['a', 'b']
    with pytest.raises(BagError, match=r'cannot read .*file: not a directory'):
        tasks(tmp_path / 'file')


def test_a_file_in_the_way_is_said_in_a_line(tmp_path):
    (tmp_path / 'task1').touch()
    task = TaskFolder(tmp_path, 'task1')
    with pytest.raises(BagError, match=r'^cannot make a bag in .*task1: file exists$'):
        task.new_episode('demo')
    with pytest.raises(BagError, match=r'^cannot read .*task1: not a directory$'):
        task.episodes()


@pytest.mark.parametrize('name', ['kichen', 'kitchn', 'kitcehn', 'kitchens', 'Kitchen', 'kitchen_',
                                  'kit-chen', 'litchen'])
def test_slips(name):
    assert close_name(name, ['door', 'kitchen', 'kitchen2']) == 'kitchen'


@pytest.mark.parametrize(('name', 'others'), [
    ('kitchen', ['kitchen']), ('task2', ['task1', 'task']), ('task10', ['task1', 'task11']),
    ('task_b', ['task_a']), ('kitchen_left', ['kitchen_right', 'kitchen']), ('b', ['a', 'c']),
    ('left', ['lift']), ('living_room', ['dining_room']), ('north', ['south']),
    ('2', ['1']), ('run-2026-11-27', ['run-2026-11-26']), ('room02', ['room2x3'])])
def test_different_on_purpose(name, others):
    assert close_name(name, others) is None


@given(words, words)
def test_the_distance_is_one(first, second):
    slips = distance(first, second)
    assert slips == distance(second, first)
    assert (slips == 0) == (first == second)
    assert abs(len(first) - len(second)) <= slips <= max(len(first), len(second))


@given(words, st.integers(0, 6))
def test_two_letters_that_are_swapped_are_one_slip(word, first):
    at = first % max(len(word) - 1, 1)
    swapped = word[:at] + word[at:at + 2][::-1] + word[at + 2:]
    assert distance(word, swapped) <= 1


def test_a_task_that_has_bags_is_always_meant(tmp_path):
    demonstration_bag(tmp_path)
    (tmp_path / 'task1').rename(tmp_path / 'kitchen')
    with pytest.raises(ValueError, match='set task:=kitchen, or new_task:=true'):
        TaskFolder(tmp_path, 'kichen').check_is_meant()
    TaskFolder(tmp_path, 'door').check_is_meant()
    (tmp_path / 'kitchen').rename(tmp_path / 'kichen')
    TaskFolder(tmp_path, 'kichen').check_is_meant()


def test_the_learner_asks_in_one_line(quiet_domain, tmp_path):
    demonstration_bag(tmp_path)
    (tmp_path / 'task1').rename(tmp_path / 'kitchen')
    parameters = {'bags': str(tmp_path), 'task': 'kichen'}
    process = ros_helpers.start_node('learner_node.node', tmp_path, parameters)
    assert process.wait() == 2
    line, = process.stderr.splitlines()
    assert 'set task:=kitchen, or new_task:=true if a new one is meant' in line
    assert not (tmp_path / 'kichen').exists()
