"""What is missing in the middle of a bag is found, and said wherever the bag is."""

import json
from pathlib import Path
import shutil

import numpy as np
import pytest
from rclpy.serialization import serialize_message

from bridge_helpers import GRID, nanoseconds, ODOMETRY, raw_status, STATUS, TWIST
from control_field.parameters import Parameters
from control_field.records import Outcome
from episode_store import gaps as bag_gaps
from episode_store.episode import Episode
from episode_store.gaps import KEY, KEY_BEFORE, note_gaps
from episode_store.header import EpisodeHeader, LOST_NAME
from episode_store.making import start_bag
from episode_store.repair import repair_bag
from episode_store.rosbag2.errors import mcap_path
from episode_store.rosbag2.metadata import custom_data
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.writer import BagWriter, HEADER_NAME
from episode_store.task_folder import episode_from_path, EpisodeKind, TaskFolder
from episode_store.trim import drop_messages
from experience_cli.main import main
from learner_node.learning.task_memory import TaskMemory
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.trial_status import State
from msgs_bridge.messages.velocities import twist_from_velocity
from ros_helpers import ROOT


@pytest.fixture
def task(tmp_path):
    shutil.copytree(ROOT / 'bags/sample', tmp_path / 'sample')
    return TaskFolder(tmp_path, 'sample')


def lose(folder: Path, topic: str, first: float, last: float):
    """Take the messages of a topic between two seconds of the drive out of a bag."""
    records = list(BagReader(mcap_path(folder)).records())
    start = next(log for channel, log, _, _ in records if channel.topic == '/odom')
    places = {place for place, (channel, log, _, _) in enumerate(records)
              if channel.topic == topic and first <= (log - start) * 1e-9 <= last}
    assert places
    drop_messages(episode_from_path(folder), places)


def test_whole_bags_have_no_gaps(task):
    for episode in task.episodes():
        before = (episode.path / 'metadata.yaml').read_bytes()
        assert not note_gaps(Episode.at(episode.path))
        assert (episode.path / 'metadata.yaml').read_bytes() == before


def test_a_hole_in_the_odometry_is_found_where_it_is(task):
    folder = task.find(2).path
    lose(folder, '/odom', 5.0, 8.0)
    [hole] = Episode.at(folder).gaps.holes
    assert hole.role == 'odom'
    assert hole.start == pytest.approx(4.9, abs=0.11)
    assert hole.end == pytest.approx(8.1, abs=0.11)


@pytest.mark.parametrize(('first', 'last'), [(0.05, 3.0), (17.0, 99.0)])
def test_what_is_missing_at_an_end_is_known_from_what_was_decided_and_said(task, first, last):
    folder = task.find(2).path
    lose(folder, '/odom', first, last)
    assert Episode.at(folder).gaps.holes


def test_a_decision_that_is_missing_is_told_by_its_number(task):
    folder = task.find(3).path
    lose(folder, '/experience', 5.0, 7.0)
    gaps = Episode.at(folder).gaps
    assert gaps.n_missing > 0
    assert f'of {gaps.n_decided} decisions are missing' in str(gaps)
    assert f'number {gaps.missing[0]}' in str(gaps)


def test_everybody_calls_it_incomplete(task, capsys):
    folder = task.find(2).path
    lose(folder, '/odom', 5.0, 8.0)
    note_gaps(Episode.at(folder))
    said = 'nothing on odom from 4.'
    assert said in custom_data((folder / 'metadata.yaml').read_text())[KEY]
    assert main(['list', str(task.path)]) == 0
    listed = capsys.readouterr().out
    assert [line.split()[2] for line in listed.splitlines()[1:4]] == ['kept', 'incomplete', 'kept']
    assert said in listed
    assert main(['show', str(folder)]) == 0
    assert said in capsys.readouterr().out
    assert main(['show', str(folder), '--json']) == 0
    [hole] = json.loads(capsys.readouterr().out)['holes']
    assert hole['topic'] == 'odom'
    assert main(['learn', str(task.path), '--check', '--quiet']) == 1
    found = capsys.readouterr().err
    assert said in found
    assert '1 bag of these is incomplete' in found
    assert main(['inspect', str(folder), '--out', str(task.root / 'drawn.png')]) == 0
    assert said in capsys.readouterr().err


def test_nothing_is_explained_within_a_hole(task, capsys):
    folder = task.find(2).path
    lose(folder, '/odom', 5.0, 8.0)
    assert main(['explain', str(folder), '--at', '6.5']) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert 'nothing on odom from 4.' in line
    stamp = Episode.at(folder).header and 20.6 + 6.5
    assert main(['explain', str(folder), '--at', str(stamp)]) == 2
    assert main(['explain', str(folder), '--at', '9.5']) == 0
    assert 'incomplete' in capsys.readouterr().err


def test_a_demonstration_is_not_learnt_across_a_hole(task, capsys):
    folder = task.find(1).path
    lose(folder, '/odom', 5.0, 12.0)
    assert main(['list', str(task.path)]) == 0
    listed = capsys.readouterr().out
    assert listed.splitlines()[1].split()[2:4] == ['not', 'kept']
    assert 'the recording is incomplete: nothing on odom from' in listed


def test_the_learner_says_what_is_missing_of_what_it_has_recorded(task):
    episode = task.find(2)
    lose(episode.path, '/odom', 5.0, 8.0)
    header = Episode.at(episode.path).header
    task_memory = TaskMemory(task, header.grid, header.parameters)
    task_memory.learn(task.find(1))
    assert 'the recording is incomplete: nothing on odom' in task_memory.learn(episode).note
    assert KEY in custom_data((episode.path / 'metadata.yaml').read_text())


def test_what_the_middleware_lost_is_in_the_bag_and_stays_there(task):
    folder, old = task.path / '0004_trial', BagReader(task.find(3).bag)
    folder.mkdir()
    values = next(values for name, values in old.metadata if name == HEADER_NAME)
    with BagWriter(folder, values) as bag:
        for channel, log, sent, message in old.records():
            bag.write(channel.topic, channel.schema.name, message, log, sent)
        bag.note(LOST_NAME, {'/trial': '9', '/odom': '2'})
    assert '9 messages lost on /trial' in str(Episode.at(folder).gaps)
    path = mcap_path(folder)
    path.write_bytes(path.read_bytes()[:-60])
    assert repair_bag(folder).changed
    assert Episode.at(folder).gaps.lost == {'/trial': 9, '/odom': 2}


class TestHoles:

    @staticmethod
    def holes(stamps, role='odom'):
        return [(hole.start, hole.end)
                for hole in bag_gaps._holes(role, np.array(stamps), 0.0, [])]

    @pytest.mark.parametrize('period', [0.005, 0.02, 0.1, 1.0, 10.0])
    def test_a_slow_topic_is_no_hole(self, period):
        assert self.holes(np.arange(50) * period) == []

    def test_late_and_doubled_messages_are_none(self):
        stamps = (np.arange(200) * 0.05).tolist()
        stamps[100:103] = reversed(stamps[100:103])
        assert self.holes(sorted([*stamps, *stamps[:50]])) == []
        assert self.holes(stamps) == []

    def test_a_clock_that_was_set_back_is_none(self):
        assert self.holes([*np.arange(100) * 0.05 + 100.0, *np.arange(100) * 0.05]) == []

    def test_each_one_is_found(self):
        stamps = np.arange(1000) * 0.02
        kept = stamps[(stamps < 3.0) | ((stamps > 4.0) & (stamps < 10.0)) | (stamps > 15.0)]
        assert np.allclose(self.holes(kept), [(2.98, 4.02), (9.98, 15.02)])


class TestBeforeTheDrive:
    """What lies before the first movement of a demonstration is no hole in the drive."""

    @staticmethod
    def bag(tmp_path, late=10.75, stands=1.0, orders=(), missing=(0.0, 0.0)):
        """Record a drive whose odometry came late; ``orders`` are times of commands to move."""
        task = TaskFolder(tmp_path, 'task')
        header = EpisodeHeader(EpisodeKind.DEMO, 'task', GRID, Parameters())
        with start_bag(task, EpisodeKind.DEMO, header.to_mapping()) as bag:
            bag.write('/trial', STATUS, raw_status(State.RUNNING, stamp=100.0 - late),
                      nanoseconds(100.0 - late))
            for time in orders:
                bag.write('/cmd_vel', TWIST, serialize_message(twist_from_velocity(0.2, 0.0)),
                          nanoseconds(100.0 + time))
            for i in range(int(stands * 20) + 200):
                time, x = i * 0.05, 0.6 + 0.01 * max(i - int(stands * 20), 0)
                if not missing[0] < time < missing[1]:
                    pose = Pose(100.0 + time, x, 0.875, 0.0, 0.2 if x > 0.6 else 0.0, 0.0)
                    bag.write('/odom', ODOMETRY, serialize_message(odometry_from_pose(pose)),
                              nanoseconds(100.0 + time))
            bag.write('/trial', STATUS, raw_status(
                State.ENDED, outcome=Outcome.GOAL, stamp=110.0 + stands - 0.05),
                nanoseconds(111.0 + stands))
        return bag.folder

    @pytest.mark.parametrize('late', [1.0, 10.75])
    def test_odometry_that_paused_before_it_is_stated_and_the_drive_is_whole(
            self, tmp_path, capsys, late):
        folder = self.bag(tmp_path, late)
        gaps = note_gaps(Episode.at(folder))
        assert not gaps
        assert str(gaps) == ''
        said = f'nothing on odom from -{late:.2f} s to 0.00 s'
        assert gaps.before_the_drive().startswith(said)
        noted = custom_data((folder / 'metadata.yaml').read_text())
        assert said in noted[KEY_BEFORE]
        assert KEY not in noted
        assert main(['learn', str(folder.parent), '--check', '--quiet']) in (0, 1)
        assert 'incomplete' not in capsys.readouterr().err
        assert main(['show', str(folder)]) == 0
        assert said in capsys.readouterr().out
        assert main(['list', str(folder)]) == 0
        assert ' kept ' in capsys.readouterr().out

    def test_a_pause_while_it_stands_is_none_either(self, tmp_path):
        gaps = Episode.at(self.bag(tmp_path, 0.05, stands=8.0, missing=(1.0, 6.0))).gaps
        assert not gaps
        [hole] = gaps.before
        assert (hole.start, hole.end) == pytest.approx((1.0, 6.0), abs=0.06)
        assert gaps.hole_at(3.0) == hole

    @pytest.mark.parametrize('changes', [
        {'stands': 0.0}, {'orders': [-5.0]}, {'missing': (0.5, 3.0)}], ids=[
        'it moves at once', 'it was told to move', 'a hole over its first movement'])
    def test_where_the_robot_may_have_moved_the_recording_is_incomplete(self, tmp_path, changes):
        gaps = Episode.at(self.bag(tmp_path, **{'late': 10.0, **changes})).gaps
        assert gaps
        assert 'incomplete' in str(gaps)

    def test_an_order_after_it_changes_nothing(self, tmp_path):
        assert not Episode.at(self.bag(tmp_path, orders=[0.9])).gaps
