"""What the fold over bags tells beside the field."""

from itertools import combinations
from pathlib import Path

import pytest

from control_field.grid import Grid
from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder
from ros_helpers import ROOT


@pytest.fixture(scope='module')
def relearner():
    task = TaskFolder(Path(ROOT) / 'bags', 'sample')
    episodes = task.episodes()
    header = Episode.at(episodes[0].path).header
    taught = Relearner(header.grid, header.parameters)
    for episode in episodes:
        taught.learn(Episode(episode))
    return taught


def test_places_to_teach_from_lie_apart_and_in_the_workspace(relearner):
    places = [relearner.grid.cell_from_world(x, y) for x, y in relearner.teach_here(4)]
    assert len(places) == 4
    assert all(relearner.grid.contains(*place) for place in places)
    assert all(max(abs(a - c), abs(b - d)) >= 4
               for (a, b), (c, d) in combinations(places, 2))


def test_no_more_places_than_asked_for(relearner):
    assert len(relearner.teach_here(2)) == 2


def test_what_the_learner_refuses_names_the_bag(relearner, monkeypatch):
    taught = Relearner(relearner.grid, relearner.parameters)
    bag = TaskFolder(Path(ROOT) / 'bags', 'sample').episodes()[0]
    # No drive is known that gets so far; should there be one, the commands say it in a line.
    monkeypatch.setattr(taught._learner.memory, 'grid', Grid(1, 1, 0.25))
    with pytest.raises(BagError, match=r'0001_demo cannot be learnt from: a demonstration leaves'):
        taught.learn(Episode(bag))
