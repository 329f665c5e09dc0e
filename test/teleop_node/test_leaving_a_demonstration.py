"""A demonstration whose teacher is gone ends by itself, and is neither lost nor learnt."""

import pytest
from std_srvs.srv import Trigger

from bridge_helpers import content_of
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from learner_node.session.demonstration import LEFT
from person_helpers import Person, REAL_TIME
import ros_helpers


@pytest.mark.slow
def test_after_a_closed_window_it_ends_as_not_kept_and_can_be_kept(ros_node, tmp_path):
    person, bag = Person(ros_node, tmp_path, REAL_TIME, teacher_timeout=3.0), '0001_demo'
    with person.stack:
        person.wait(lambda: person.pose is not None and person.statuses, 'the others')
        person.types('s', 'start demonstration')
        person.holds('i', lambda pose: pose.x > 1.2, 'a part of the way')
        person.terminal.close()
        ros_helpers.wait_until(
            lambda: f'has ended, because {LEFT}' in person.others[-1].stderr,
            node=ros_node, processes=person.others, what='the end of the recording')
        assert person.episodes() == [bag]
        with pytest.raises(NothingToLearnError, match=LEFT):
            content_of(tmp_path / 'bags/drive' / bag)
        answer = ros_helpers.call(ros_node, Trigger, 'learner_node/label_success')
        assert answer.success, answer.message
        episode = Episode.at(tmp_path / 'bags/drive' / bag)
        places = episode.header.grid.world_from_cells(episode.content.record.cells[:3])
        assert places.tolist() == [[0.625, 0.875], [0.875, 0.875], [1.125, 0.875]]
