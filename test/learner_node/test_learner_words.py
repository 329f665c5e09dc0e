"""What the learner says where a drive is kept."""

import numpy as np
import pytest

from bridge_helpers import GRID, loop_bag, nanoseconds, ODOMETRY, raw_odometry
from control_field.parameters import Parameters
from episode_store.episode import Episode
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.relearn import Relearner
from episode_store.task_folder import TaskFolder
from experience_cli.commands.learn import text_from_learnt_bag
from learner_node.learning.task_memory import TaskMemory
from learner_node.reports import numbers_from_learnt_bag, sentence_from_learnt_bag

#: There, once around a block, and on.
ROUND = [(2, 2), (2, 3), (2, 4), (2, 5), (3, 5), (4, 5), (4, 4), (4, 3), (3, 3), (2, 3), (1, 3)]


@pytest.fixture
def relearner():
    return Relearner(GRID, Parameters())


def learn(relearner, folder):
    return relearner.learn(Episode.at(folder))


def test_a_plain_sentence_says_it_and_numbers_are_apart(tmp_path, relearner):
    learnt_bag = learn(relearner, loop_bag(tmp_path, ROUND[:5]))
    sentence = sentence_from_learnt_bag(learnt_bag)
    assert sentence.startswith('Drive 0001 kept: 4 steps. With a pose every 1 s nobody can tell ')
    assert ' look like driving. From all ' in sentence
    assert sentence.endswith(' the robot gets to the goal.')
    assert numbers_from_learnt_bag(learnt_bag).startswith('5 cells from 5 poses')
    assert 'goal is now' not in sentence


def test_how_much_of_a_drive_is_a_loop_and_where(tmp_path, relearner):
    sentence = sentence_from_learnt_bag(learn(relearner, loop_bag(tmp_path, ROUND)))
    assert sentence.startswith(
        'Drive 0001 kept: 2 steps. 8 of 11 cells driven are not learnt, they only lead back to '
        'where the robot had been: 8 (2.0 m) from (0.88, 0.62) back to it, 1.0 to 9.0 s. With ')


def test_a_drive_that_moves_the_goal_says_so_wherever_it_is_learnt(tmp_path, relearner):
    folders = [loop_bag(tmp_path, ROUND[:n]) for n in (5, 5, 7)]
    moved = [learn(relearner, folder) for folder in folders]
    assert [bool(learnt_bag.moved) for learnt_bag in moved] == [False, False, True]
    said = 'The goal is now at (1.12, 1.12) m, it was at (1.38, 0.88) m'
    assert said in sentence_from_learnt_bag(moved[2])
    assert said in text_from_learnt_bag(moved[2])


def test_a_bag_that_is_taken_away_may_move_the_goal_back(tmp_path):
    for n in (5, 7):
        loop_bag(tmp_path, ROUND[:n])
    task_memory = TaskMemory(TaskFolder(tmp_path, 'task1'), GRID, Parameters())
    task_memory.relearn()
    assert 'The goal is now at (1.38, 0.88) m, it was at (1.12, 1.12) m' in task_memory.drop()


def test_a_drive_that_is_refused_says_why_and_what_to_do(tmp_path, relearner):
    header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', header) as bag:
        for i, x in enumerate(np.r_[0.5:1.5:0.01, 3.0:4.0:0.01].tolist()):
            bag.write('/odom', ODOMETRY, raw_odometry(i / 20, x, 1.0), nanoseconds(i / 20))
    sentence = sentence_from_learnt_bag(learn(relearner, bag.folder))
    assert sentence.startswith('Drive 0001 is not learnt: this is not one drive of one robot: at '
                               '5.00 s the pose leaps by 1.51 m in 0.05 s, from (1.49, 1.00) to '
                               '(3.00, 1.00), ')
    assert 'show the way again in one go' in sentence
