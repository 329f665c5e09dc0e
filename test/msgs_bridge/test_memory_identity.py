"""A field names the task and the memory it was learnt from; the same bags give the same name."""

import dataclasses

import pytest

from bridge_helpers import (
    content_of, GRID, random_decisions, random_field, random_prototypes, raw_decisions, raw_status)
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.relearn import relearnt
from episode_store.task_folder import EpisodeKind, TaskFolder
from msgs_bridge.messages.clouds import table_from_cloud
from msgs_bridge.messages.memory_identity import difference, memory_of, NOTHING, task_of
from msgs_bridge.messages.tables import cloud_from_field, FIELD_DTYPE, field_from_cloud
from msgs_bridge.messages.trial_status import (
    State, status_from_trial, trial_from_status, TrialStatus)
from sample_helpers import BAGS, sample_copy

FIELD, PROTOTYPES = random_field(GRID, 1), random_prototypes(GRID, 1)
OWN, OTHER = 'kitchen:0123456789abcdef', 'hall:fedcba9876543210'


def test_it_names_the_task_and_what_its_memory_holds():
    own = memory_of('kitchen', FIELD, PROTOTYPES)
    assert task_of(own) == 'kitchen'
    assert memory_of('kitchen', dataclasses.replace(FIELD, memory=own), PROTOTYPES) == own
    others = [memory_of('hall', FIELD, PROTOTYPES),
              memory_of('kitchen', random_field(GRID, 2), PROTOTYPES),
              memory_of('kitchen', FIELD, random_prototypes(GRID, 2)),
              memory_of('kitchen', dataclasses.replace(FIELD, revision=7), PROTOTYPES)]
    assert len({own, *others}) == 5


def test_the_same_bags_give_the_same_one(tmp_path):
    names = {memory_of('sample', learnt.field, learnt.prototypes) for learnt in (
        relearnt(TaskFolder(BAGS, 'sample')), relearnt(sample_copy(tmp_path)))}
    assert len(names) == 1


def test_a_field_carries_it_and_its_table_stays_as_it_was():
    named = cloud_from_field(dataclasses.replace(FIELD, memory=OWN))
    plain = cloud_from_field(FIELD)
    assert field_from_cloud(named).memory == OWN
    assert field_from_cloud(plain).memory == ''
    assert bytes(named.data) == bytes(plain.data)
    assert named.fields[:-1] == plain.fields
    # A reader of before passes the name over.
    assert (table_from_cloud(named, FIELD_DTYPE) == table_from_cloud(plain, FIELD_DTYPE)).all()


@pytest.mark.parametrize('names', [
    ['memory:a:0', 'memory:b:0'], ['memory:\x1b[2J'], ['memory:'], ['memory']])
def test_a_name_that_is_none_is_passed_over(names):
    msg = cloud_from_field(dataclasses.replace(FIELD, memory=OWN))
    last = msg.fields.pop()
    for name in names:
        field = type(last)(name=name, offset=last.offset, datatype=last.datatype, count=1)
        msg.fields.append(field)
    assert field_from_cloud(msg).memory == ''


def test_a_status_carries_it():
    status = TrialStatus(State.RUNNING, 3, memory=OWN)
    assert trial_from_status(status_from_trial(status)) == status
    plain = TrialStatus(State.RUNNING, 3)
    assert 'memory' not in {pair.key for pair in status_from_trial(plain).values}
    assert trial_from_status(status_from_trial(plain)) == plain


def test_a_header_carries_it_and_old_ones_do_without():
    header = EpisodeHeader(EpisodeKind.TRIAL, 'kitchen', GRID, memory=OWN)
    assert EpisodeHeader.from_mapping(header.to_mapping()) == header
    plain = EpisodeHeader(EpisodeKind.TRIAL, 'kitchen', GRID)
    assert 'memory' not in plain.to_mapping()
    assert EpisodeHeader.from_mapping(plain.to_mapping()) == plain


@pytest.mark.parametrize(('theirs', 'own', 'words'), [
    (OWN, OWN, []),
    ('', OWN, ['does not say', 'older version']),
    (OTHER, OWN, ['task hall', 'kitchen', 'second learner', 'namespace', 'ROS_DOMAIN_ID']),
    ('kitchen:0000000000000000', OWN, ['another field of task kitchen', 'second learner']),
    (OTHER, NOTHING, ['task hall', 'none of its own yet']),
    (OTHER, '', ['task hall', 'none of its own yet'])])
def test_a_difference_holds_its_remedy(theirs, own, words):
    said = difference(theirs, own)
    assert bool(said) == bool(words)
    assert all(word in said for word in words)


def trial(folder, memory, header_memory, outcome=Outcome.GOAL):
    header = EpisodeHeader(EpisodeKind.TRIAL, 'task1', GRID, memory=header_memory).to_mapping()
    kind = 'diagnostic_msgs/msg/DiagnosticStatus'
    with start_bag(TaskFolder(folder, 'task1'), EpisodeKind.TRIAL, header) as bag:
        bag.write('/trial', kind, raw_status(State.RUNNING, 1, memory=memory), 0)
        bag.write('/experience', 'sensor_msgs/msg/PointCloud2',
                  raw_decisions(random_decisions(GRID, 3, 1)), 1)
        bag.write('/trial', kind, raw_status(
            State.ENDED, 1, outcome, decisions=3, memory=memory), 2)
    return bag.folder


@pytest.mark.parametrize(('memory', 'header_memory'), [(OTHER, OWN), ('', OWN)])
def test_a_trial_on_the_field_of_another_memory_teaches_nothing(tmp_path, memory, header_memory):
    folder = trial(tmp_path, memory, header_memory)
    with pytest.raises(NothingToLearnError, match=r'the controller (drives|does not say)'):
        content_of(folder)


def test_bags_of_before_there_were_names_are_read(tmp_path):
    read = Episode.at(trial(tmp_path, '', ''))
    assert read.header.memory == ''
    assert read.content.record.outcome is not Outcome.ABORTED


def test_a_bag_of_a_trial_that_was_broken_off_is_read_as_that(tmp_path):
    read = content_of(trial(tmp_path, '', OWN, Outcome.ABORTED))
    assert read.record.outcome is Outcome.ABORTED
