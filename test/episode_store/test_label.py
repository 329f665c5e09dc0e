"""What a person said of a bag: kept beside it, heeded when it is learnt from."""

from functools import partial

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rosbags.rosbag2 import Reader
import yaml

from bridge_helpers import (
    CLOUD, content_of, demonstration_bag, GRID, random_decisions, raw_decisions, raw_status,
    STATUS, trial_bag, write_drive)
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.header import EpisodeHeader
from episode_store.label import KEY, read_label, write_label
from episode_store.making import start_bag
from episode_store.repair import repair_bag
from episode_store.rosbag2.errors import BagError, mcap_path
from episode_store.rosbag2.metadata import custom_data, NAME, with_note
from episode_store.task_folder import EpisodeKind, TaskFolder
from episode_store.trials import judged
from msgs_bridge.messages.trial_status import Label, State


def ended_trial(root, outcome, **more):
    def write(bag):
        bag.write('/experience', CLOUD, raw_decisions(random_decisions(GRID, 4, 1), GRID), 1)
        bag.write('/trial', STATUS, raw_status(State.ENDED, 1, outcome, **more), 2)

    return trial_bag(root, write)


@pytest.mark.parametrize('label', list(Label))
def test_a_label_is_read_back_and_leaves_the_recording_alone(tmp_path, label):
    folder = demonstration_bag(tmp_path, n=20)
    recorded = mcap_path(folder).read_bytes()
    before = yaml.safe_load((folder / NAME).read_text())['rosbag2_bagfile_information']
    assert read_label(folder) is None
    write_label(folder, label)
    assert read_label(folder) == label
    assert mcap_path(folder).read_bytes() == recorded
    after = yaml.safe_load((folder / NAME).read_text())['rosbag2_bagfile_information']
    assert after.pop('custom_data') == {KEY: label or 'none'}
    assert before.pop('custom_data') is None
    assert after == before


def test_other_readers_still_read_a_labelled_bag(tmp_path):
    folder = demonstration_bag(tmp_path, n=20)
    write_label(folder, Label.FAILURE)
    with Reader(folder) as reader:
        assert reader.message_count == 62


@given(st.dictionaries(
    st.text(st.characters(codec='utf-8'), min_size=1, max_size=9),
    st.text(st.characters(codec='utf-8'), max_size=9), max_size=4))
def test_notes_of_others_stay_when_a_label_is_written(values):
    text = 'a:\n  files: 1\n  custom_data: ~\n  ros_distro: jazzy\n'
    noted = text
    for key, value in values.items():
        noted = with_note(noted, key, value, NAME)
    assert custom_data(noted) == values
    again = with_note(noted, KEY, 'success', NAME)
    assert custom_data(again) == {**values, KEY: 'success'}
    assert with_note(again, KEY, None, NAME) == noted
    for key in (KEY, *values):
        again = with_note(again, key, None, NAME)
    assert again == text


@pytest.mark.parametrize('notes', [
    ' ~', ' {}', '\n    robot: "tb3"\n    \'by\':  me # yesterday', '\n      a: |\n        b: c'])
def test_a_label_taken_back_leaves_the_notes_of_others_as_they_were_written(tmp_path, notes):
    text = f'a:\n  files: 1\n  custom_data:{notes}\n  ros_distro: jazzy\n'
    path = tmp_path / NAME
    path.write_text(text)
    write_label(tmp_path, None)
    assert path.read_text() == text
    for label in (Label.SUCCESS, Label.FAILURE):
        write_label(tmp_path, label)
        assert read_label(tmp_path) is label
        assert custom_data(path.read_text()) == {**custom_data(text), KEY: str(label)}
    write_label(tmp_path, None)
    assert path.read_text() == text.replace('{}', '~')  # that is how rosbag2 writes none


@pytest.mark.parametrize('written', [
    '  custom_data: {experience_label: failure}\n',
    '  custom_data:\n    experience_label: failure',
    '  custom_data:\n    "experience_label": \'failure\'\n'])
def test_any_way_of_writing_yaml_is_read(tmp_path, written):
    (tmp_path / NAME).write_text('rosbag2_bagfile_information:\n' + written)
    assert read_label(tmp_path) is Label.FAILURE
    write_label(tmp_path, Label.SUCCESS)
    assert custom_data((tmp_path / NAME).read_text()) == {KEY: 'success'}


def test_a_label_that_there_is_not_is_refused_with_the_choice(tmp_path):
    (tmp_path / NAME).write_text('x:\n  custom_data:\n    experience_label: sucess\n')
    with pytest.raises(BagError, match=r"'sucess', must be success, failure or none"):
        read_label(tmp_path)


def test_a_bag_that_was_not_closed_cannot_be_labelled(tmp_path):
    folder = demonstration_bag(tmp_path, n=20)
    (folder / NAME).unlink()
    with pytest.raises(BagError, match='experience repair'):
        write_label(folder, Label.SUCCESS)


def test_mending_a_bag_keeps_its_label(tmp_path):
    folder = demonstration_bag(tmp_path, n=20)
    write_label(folder, Label.FAILURE)
    path = mcap_path(folder)
    path.write_bytes(path.read_bytes()[:-400])
    assert repair_bag(folder).changed
    assert read_label(folder) is Label.FAILURE


def test_from_a_demonstration_labelled_a_failure_nothing_is_learnt(tmp_path):
    folder = demonstration_bag(tmp_path, n=60)
    write_label(folder, Label.FAILURE)
    with pytest.raises(NothingToLearnError, match='labelled the demonstration a failure'):
        content_of(folder)
    write_label(folder, Label.NONE)
    assert len(content_of(folder).record.cells) > 1


@pytest.mark.parametrize(('outcome', 'label', 'counts'), [
    (Outcome.GOAL, Label.FAILURE, Outcome.GAVE_UP),
    (Outcome.STOPPED, Label.FAILURE, Outcome.GAVE_UP),
    (Outcome.COLLISION, Label.FAILURE, Outcome.COLLISION),
    (Outcome.GAVE_UP, Label.SUCCESS, Outcome.GOAL),
    (Outcome.STOPPED, Label.SUCCESS, Outcome.GOAL),
    (Outcome.GOAL, Label.NONE, Outcome.GOAL),
    (Outcome.ABORTED, Label.SUCCESS, Outcome.ABORTED),
    (Outcome.ABORTED, Label.FAILURE, Outcome.ABORTED),
])
def test_a_person_has_the_last_word_on_how_a_trial_ended(tmp_path, outcome, label, counts):
    assert judged(outcome, label) is counts
    folder = ended_trial(tmp_path, outcome)
    write_label(folder, label)
    episode = Episode.at(folder)
    assert (episode.content.record.outcome, episode.label) == (counts, label)
    assert (f'labelled {label} by a person' in episode.content.notes) == bool(label)


def test_what_is_said_afterwards_overrides_what_was_said_under_way(tmp_path):
    folder = ended_trial(tmp_path, Outcome.GOAL, label=Label.FAILURE)
    assert content_of(folder).record.outcome is Outcome.GAVE_UP
    write_label(folder, Label.NONE)
    assert content_of(folder).record.outcome is Outcome.GOAL


def test_a_person_may_still_keep_a_demonstration_whose_recorder_died(tmp_path):
    header = EpisodeHeader(EpisodeKind.DEMO, 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(tmp_path, 'task1'), EpisodeKind.DEMO, header) as bag:
        bag.write('/trial', STATUS, raw_status(State.RUNNING), 0)
        write_drive(bag, 60)
    folder = bag.folder
    with pytest.raises(NothingToLearnError, match='was not kept'):
        content_of(folder)
    write_label(folder, Label.SUCCESS)
    assert len(content_of(folder).record.cells) > 1


@pytest.mark.parametrize('make', [demonstration_bag, partial(ended_trial, outcome=Outcome.GOAL)])
def test_a_label_taken_back_leaves_no_trace(tmp_path, make):
    folder = make(tmp_path)
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    for label in (Label.NONE, Label.SUCCESS, Label.FAILURE, Label.NONE):
        Episode.at(folder).judge(label)
        assert read_label(folder) == (label or None)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == files


def test_what_was_said_while_it_was_recorded_is_taken_back_too(tmp_path):
    folder = ended_trial(tmp_path, Outcome.GOAL, label=Label.FAILURE)
    assert Episode.at(folder).status.label is Label.FAILURE
    assert content_of(folder).record.outcome is Outcome.GAVE_UP
    Episode.at(folder).judge(Label.NONE)
    assert read_label(folder) is Label.NONE
    assert content_of(folder).record.outcome is Outcome.GOAL


def test_a_bag_that_holds_nothing_was_not_judged_while_it_was_recorded(tmp_path):
    folder = demonstration_bag(tmp_path)
    metadata = (folder / NAME).read_bytes()
    mcap_path(folder).write_bytes(b'')
    Episode.at(folder).judge(Label.FAILURE)
    Episode.at(folder).judge(Label.NONE)
    assert (folder / NAME).read_bytes() == metadata
