"""A slip in the name of a task is noticed; names that are different on purpose are not."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from bridge_helpers import demonstration_bag
from episode_store.task_folder import TaskFolder
from msgs_bridge.node.close_names import close_name, distance
import ros_helpers

words = st.text('abc', max_size=7)


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
