"""Taking bags away and bringing them back: one place, the last first, nothing lost."""

import time

import pytest

from bridge_helpers import (
    content_of, demonstration_bag, GRID, nanoseconds, raw_status, STATUS, write_drive)
from control_field.records import Outcome
from episode_store.errors import NothingToLearnError
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeKind, TaskFolder
from episode_store.undo import bring_back, names_of, take_away, THROWN_AWAY
from msgs_bridge.messages.trial_status import State


@pytest.fixture
def task(tmp_path):
    for _ in range(4):
        demonstration_bag(tmp_path, n=40)
    return TaskFolder(tmp_path, 'task1')


def numbers(episodes):
    return [episode.number for episode in episodes]


def contents(task):
    return {path.relative_to(task.path): path.read_bytes()
            for path in task.path.rglob('*') if path.is_file() and path.suffix != '.lock'}


def test_the_last_comes_back_first_whatever_its_number(task):
    before = contents(task)
    for number in (3, 1, 4):
        take_away(task, [number])
    assert numbers(task.episodes()) == [2]
    assert [numbers(bring_back(task)) for _ in range(3)] == [[4], [1], [3]]
    assert contents(task) == before
    with pytest.raises(BagError, match='nothing was taken away'):
        bring_back(task)


def test_what_goes_at_one_stroke_comes_back_at_one(task):
    take_away(task, [4])
    taken = take_away(task, [1, 2, 3])
    assert names_of(taken) == 'task1/0001 and task1/0002 and task1/0003'
    assert numbers(bring_back(task)) == [1, 2, 3]
    assert numbers(bring_back(task)) == [4]
    assert names_of(task.episodes()) == '4 bags (task1/0001 to task1/0004)'


def test_a_clock_that_is_set_back_changes_no_order(task, monkeypatch):
    take_away(task, [1])
    monkeypatch.setattr(time, 'time_ns', lambda: 5)
    take_away(task, [2])
    assert numbers(bring_back(task)) == [2]


def test_one_by_its_number_and_none_that_is_there(task):
    take_away(task, [1, 2])
    assert numbers(bring_back(task, 1)) == [1]
    with pytest.raises(BagError, match='no bag 0001'):
        bring_back(task, 1)


def test_a_number_that_was_taken_away_is_not_given_again(task):
    take_away(task, [4])
    assert task.new_episode('trial').number == 5


def test_what_cannot_be_read_comes_back_too(task):
    bag = task.episodes()[-1].bag
    bag.write_bytes(b'nothing')
    take_away(task, [4])
    assert numbers(bring_back(task)) == [4]
    assert not list((task.path / '.forgotten').iterdir())


@pytest.mark.parametrize(('reason', 'counts'), [(THROWN_AWAY, True), ('a trial ran', False)])
def test_a_demonstration_that_was_thrown_away_counts_as_kept_when_it_is_back(
    tmp_path, reason, counts,
):
    header = EpisodeHeader(EpisodeKind.DEMO, 'task1', GRID).to_mapping()
    task = TaskFolder(tmp_path, 'task1')
    with start_bag(task, EpisodeKind.DEMO, header) as bag:
        bag.write('/trial', STATUS, raw_status(State.RUNNING), 0)
        write_drive(bag)
        bag.write('/trial', STATUS, raw_status(State.ENDED, 0, Outcome.ABORTED, reason=reason),
                  nanoseconds(10))
    take_away(task, [1])
    episode, = bring_back(task)
    if counts:
        assert len(content_of(episode.path).record.cells) > 2
    else:
        with pytest.raises(NothingToLearnError, match=reason):
            content_of(episode.path)
