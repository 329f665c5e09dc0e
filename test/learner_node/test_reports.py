"""What people read of a bag that was learnt from: a sentence, numbers, and where to look."""

import pytest

from bridge_helpers import demonstration_bag, GRID
from control_field.parameters import Parameters
from control_field.records import Outcome
from control_field.words import how_it_ended
from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.task_folder import TaskFolder
from learner_node.learning.task_memory import TaskMemory
from learner_node.reports import numbers_from_learnt_bag, sentence_from_learnt_bag
from msgs_bridge.messages.trial_status import State, TrialStatus


@pytest.fixture
def task(tmp_path):
    demonstration_bag(tmp_path)
    return TaskFolder(tmp_path, 'task1')


def test_a_demonstration_is_said_plainly_before_its_numbers(task):
    learnt_bag = Relearner(GRID, Parameters()).learn(Episode(task.episodes()[0]))
    plain, numbers = sentence_from_learnt_bag(learnt_bag), numbers_from_learnt_bag(learnt_bag)
    assert plain.startswith('Drive 0001 kept: ')
    assert plain.endswith(' seen so far the robot gets to the goal.')
    assert 'cells from 200 poses' in numbers
    assert 'prototypes' in numbers
    for word in ('poses', 'basin', 'prototype', 'coherence', 'fidelity', '('):
        assert word not in plain


@pytest.mark.parametrize(('outcome', 'said'), [
    (Outcome.GOAL, 'reached the goal in 2 steps'), (Outcome.GAVE_UP, 'gave up after 2 steps'),
    (Outcome.COLLISION, 'ran into something after 2 steps'),
    (Outcome.STOPPED, 'was stopped after 2 steps'),
    (Outcome.ABORTED, 'was broken off after 2 steps')])
def test_every_end_of_a_trial_is_told_in_words(outcome, said):
    assert how_it_ended(outcome, 2) == said
    status = TrialStatus(State.ENDED, trial=3, outcome=outcome, steps=2, reason='so it was')
    assert status.sentence == f'trial 3 {said}: so it was'


def test_places_are_told_of_in_metres(task):
    task_memory = TaskMemory(task, GRID, Parameters())
    task_memory.find_places()
    assert task_memory.places == {'start': '', 'teach_here': ''}
    task_memory.relearn()
    task_memory.find_places()
    x, y, yaw = map(float, task_memory.places['start'].split())
    assert GRID.cell_from_world(x, y) == (2, 2)
    assert -3.2 < yaw < 3.2
    spots = [tuple(map(float, spot.split()))
             for spot in task_memory.places['teach_here'].split(';')]
    assert spots
    assert all(GRID.contains(*GRID.cell_from_world(*spot)) for spot in spots)
