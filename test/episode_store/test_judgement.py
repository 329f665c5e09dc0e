"""What a person says of a bag and takes back again."""

import pytest

from bridge_helpers import (
    CLOUD, content_of, demonstration_bag, GRID, random_decisions, raw_decisions, raw_status,
    STATUS, trial_bag)
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.label import read_label
from episode_store.rosbag2.errors import mcap_path
from episode_store.rosbag2.metadata import NAME
from msgs_bridge.messages.trial_status import Label, State


def trial(root, **said):
    def write(bag):
        bag.write('/experience', CLOUD, raw_decisions(random_decisions(GRID, 4, 1), GRID), 1)
        bag.write('/trial', STATUS, raw_status(State.ENDED, 1, Outcome.GOAL, **said), 2)

    return trial_bag(root, write)


@pytest.mark.parametrize('make', [demonstration_bag, trial])
def test_a_label_taken_back_leaves_no_trace(tmp_path, make):
    folder = make(tmp_path)
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    for label in (Label.NONE, Label.SUCCESS, Label.FAILURE, Label.NONE):
        Episode.at(folder).judge(label)
        assert read_label(folder) == (label or None)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == files


def test_what_was_said_while_it_was_recorded_is_taken_back_too(tmp_path):
    folder = trial(tmp_path, label=Label.FAILURE)
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
