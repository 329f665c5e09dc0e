"""Episodes: what bags of ours and of others teach."""

import time

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from bridge_helpers import (
    CLOUD, content_of, demonstration_bag, GRID, LOOP, loop_bag, OCCUPANCY, ODOMETRY,
    random_decisions, raw_decisions, raw_local_grid, raw_odometry, raw_status, STATUS, trial_bag,
    write_drive)
from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.header import EpisodeHeader, find_topic
from episode_store.making import start_bag
from episode_store.relearn import relearn, Relearner
from episode_store.repair import repair_bag
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.errors import BagError, mcap_path
from episode_store.rosbag2.topic_tables import local_grid_table, pose_table
from episode_store.task_folder import TaskFolder
from external_bags import EXTERNAL, external_bag, external_demonstration
from msgs_bridge.messages.trial_status import Label, State


def write_statuses(bag, *statuses):
    for status in statuses:
        bag.write('/trial', STATUS, status, 0)


def write_rows(bag, rows):
    for first in range(0, len(rows), 3):
        bag.write('/experience', CLOUD, raw_decisions(rows[first:first + 3]), 0)


class TestDemonstrations:
    """Bags of demonstrations."""

    def test_the_cells_are_those_that_were_driven_through(self, tmp_path):
        episode = content_of(demonstration_bag(tmp_path))
        cells = episode.record.cells
        stamps = np.arange(200) / 20.0
        driven = GRID.cells_from_world(
            np.stack([0.5 + 0.2 * stamps, 0.6 + 0.1 * stamps], axis=1))
        assert {tuple(cell) for cell in cells.tolist()} <= {tuple(c) for c in driven.tolist()}
        assert cells[0].tolist() == driven[0].tolist()
        assert cells[-1].tolist() == driven[-1].tolist()
        assert (episode.record.unknown == 0).all()
        assert (episode.record.episode, episode.notes) == (1, ())
        assert episode.report.n_poses == 200

    def test_the_same_bag_gives_the_same_record(self, tmp_path):
        folder = demonstration_bag(tmp_path)
        first, second = (content_of(folder).record for _ in range(2))
        for name in ('cells', 'stamps', 'blocked', 'unknown'):
            assert getattr(first, name).tobytes() == getattr(second, name).tobytes()

    def test_messages_that_are_refused_are_counted(self, tmp_path):
        header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
        with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', header) as bag:
            write_drive(bag)
            bag.write('/odom', ODOMETRY, raw_odometry(3.0, 1.0, 1.0, 'map'), 0)
            bag.write('/neighbourhood', OCCUPANCY,
                      raw_local_grid(3.0, 1, 1, np.zeros((3, 3)), Grid(20, 20, 0.5)), 0)
        notes = content_of(bag.folder).notes
        assert notes[0] == ("1 message refused, the first: "
                            "/odom: frame is 'map', must be 'odom'")
        assert notes[1].startswith('1 message refused, the first: /neighbourhood: resolution')

    def test_late_and_doubled_messages_change_nothing(self, tmp_path):
        header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
        order = np.arange(200)
        rng = np.random.default_rng(0)
        mixed = np.concatenate([order, order[::7]])
        mixed = mixed[np.argsort(mixed + rng.uniform(0, 4, len(mixed)))]
        records = []
        for sequence in (order, mixed):
            with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', header) as bag:
                for i in sequence.tolist():
                    bag.write('/odom', ODOMETRY, raw_odometry(i / 20, 0.5 + 0.01 * i, 0.6), i)
            records.append(content_of(bag.folder).record)
        assert records[0].cells.tolist() == records[1].cells.tolist()
        assert records[0].stamps.tolist() == records[1].stamps.tolist()

    @pytest.mark.parametrize('way', [0.0, 0.04], ids=['stood', 'drove'])
    def test_after_a_jump_of_the_clock_only_a_whole_drive_counts(self, tmp_path, way):
        header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
        with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', header) as bag:
            for i in range(100):
                bag.write('/odom', ODOMETRY, raw_odometry(50 + i / 20, 4.0, 0.1 + way * i), i)
            write_drive(bag)
        if way:
            with pytest.raises(NothingToLearnError, match=r'4.95 s the stamps go back by 54.95 s'):
                content_of(bag.folder)
            return
        episode = content_of(bag.folder)
        assert '100 poses before the drive left out: at 4.95 s the stamps go back' in str(
            episode.report)
        assert episode.record.cells[0].tolist() == [2, 2]

    @pytest.mark.parametrize('statuses', [
        [raw_status(State.RUNNING)],
        [raw_status(State.RUNNING), raw_status(State.ENDED, 0, Outcome.ABORTED, reason='killed')],
        [raw_status(State.ENDED, 7, Outcome.GOAL), raw_status(State.RUNNING)]],
        ids=['killed', 'aborted', 'a trial before'])
    def test_what_was_not_kept_teaches_nothing(self, tmp_path, statuses):
        header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
        with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', header) as bag:
            write_statuses(bag, *statuses)
            write_drive(bag)
        with pytest.raises(NothingToLearnError, match='the demonstration was not kept'):
            content_of(bag.folder)

    def test_a_drive_that_ends_where_it_began_teaches_nothing(self, tmp_path):
        folder = loop_bag(tmp_path)
        with pytest.raises(NothingToLearnError, match='where it began, so that'):
            content_of(folder)
        with pytest.raises(BagError, match='end the drive at the goal'):
            external_demonstration(folder, GRID)

    def test_a_drive_over_its_goal_and_back_to_it_is_a_way_there(self, tmp_path):
        folder = loop_bag(tmp_path, LOOP[1:])
        assert len(content_of(folder).record.cells) == len(LOOP) - 1

    def test_nothing_driven_or_recorded(self, tmp_path):
        task, header = TaskFolder(tmp_path, 'task1'), EpisodeHeader('demo', 'task1', GRID)
        with start_bag(task, 'demo', header.to_mapping()) as bag:
            for i in range(9):
                bag.write('/odom', ODOMETRY, raw_odometry(i, 1.1, 1.1), i)
        start_bag(task, 'demo', header.to_mapping()).close()
        repair_bag(task.new_episode('demo').path)
        sentences = ['nothing to learn from this drive', 'has no pose in it', 'is empty']
        for episode, sentence in zip(task.episodes(), sentences, strict=True):
            with pytest.raises(NothingToLearnError, match=sentence):
                content_of(episode.path)
        assert [bag.refresh for bag in relearn(task.episodes())[1]] == [None] * 3

    def test_a_bag_of_a_few_bytes_is_said_to_be_cut_off(self, tmp_path):
        folder = demonstration_bag(tmp_path)
        bag = mcap_path(folder)
        bag.write_bytes(bag.read_bytes()[:100])
        for _ in range(2):
            with pytest.raises(NothingToLearnError, match='was cut off so early'):
                content_of(folder)
            repair_bag(folder)


class TestTrials:
    """Bags of trials."""

    def test_decisions_and_outcome(self, tmp_path):
        rows = random_decisions(GRID, 50, 1, trial=4)

        def write(bag):
            write_statuses(bag, raw_status(State.RUNNING, 4))
            write_rows(bag, rows)
            write_statuses(bag, raw_status(State.ENDED, 4, Outcome.COLLISION, decisions=50),
                           raw_status(State.ENDED, 4, Outcome.COLLISION, decisions=50,
                                      label=Label.FAILURE))

        episode = Episode.at(trial_bag(tmp_path, write))
        record = episode.content.record
        np.testing.assert_array_equal(record.decisions, rows)
        assert (record.outcome, episode.label, episode.content.notes) == (
            Outcome.COLLISION, Label.FAILURE, ('labelled failure by a person',))

    def test_a_trial_that_was_broken_off_is_aborted(self, tmp_path):
        def write(bag):
            # Latched: the trial before, of a controller that was started anew since.
            write_statuses(bag, raw_status(State.ENDED, 1, Outcome.GOAL),
                           raw_status(State.RUNNING, 1))
            write_rows(bag, random_decisions(GRID, 5, 1))

        episode = content_of(trial_bag(tmp_path, write))
        assert episode.record.outcome is Outcome.ABORTED
        assert len(episode.record.decisions) == 5
        assert episode.status is None

    def test_only_the_bags_own_trial_counts(self, tmp_path):
        def write(bag):
            write_rows(bag, random_decisions(GRID, 4, 1, trial=2))
            write_statuses(bag, raw_status(State.RUNNING, 3))
            write_rows(bag, random_decisions(GRID, 6, 2, trial=3))
            write_statuses(bag, raw_status(State.ENDED, 3, Outcome.GOAL, decisions=8),
                           raw_status(State.RUNNING, 4))

        episode = content_of(trial_bag(tmp_path, write))
        np.testing.assert_array_equal(
            episode.record.decisions, random_decisions(GRID, 6, 2, trial=3))
        assert episode.record.outcome is Outcome.GOAL
        assert episode.notes == ('2 of 8 decisions are missing',)

    def test_without_a_start_the_last_decision_names_the_trial(self, tmp_path):
        def write(bag):
            write_rows(bag, random_decisions(GRID, 6, 2, trial=3))
            write_statuses(bag, raw_status(State.ENDED, 3, Outcome.GAVE_UP))

        episode = content_of(trial_bag(tmp_path, write))
        assert (len(episode.record.decisions), episode.record.outcome) == (6, Outcome.GAVE_UP)

    def test_a_trial_without_decisions(self, tmp_path):
        episode = content_of(trial_bag(tmp_path, lambda bag: write_statuses(
            bag, raw_status(State.ENDED, 5, Outcome.STOPPED))))
        assert (len(episode.record.decisions), episode.record.outcome) == (0, Outcome.STOPPED)
        episode = content_of(trial_bag(tmp_path, lambda bag: None))
        assert (len(episode.record.decisions), episode.record.outcome) == (0, Outcome.ABORTED)

    def test_a_cut_bag_gives_what_is_readable(self, tmp_path):
        folder = trial_bag(tmp_path, lambda bag: (
            write_statuses(bag, raw_status(State.RUNNING, 1)),
            write_rows(bag, random_decisions(GRID, 300, 1)),
            write_statuses(bag, raw_status(State.ENDED, 1, Outcome.GOAL))))
        path = mcap_path(folder)
        path.write_bytes(path.read_bytes()[:60_000])
        before = content_of(folder).record
        repair_bag(folder)
        after = content_of(folder).record
        assert before.outcome is after.outcome is Outcome.ABORTED
        assert 0 < len(before.decisions) < 300
        np.testing.assert_array_equal(before.decisions, after.decisions)


class TestRefusals:
    """Bags that do not belong here."""

    def test_another_workspace_is_named(self, tmp_path):
        demonstration_bag(tmp_path)
        relearner = Relearner(Grid(20, 21, 0.25), Parameters())
        with pytest.raises(BagError, match=r'0001_demo was recorded on 20 x 20 .* is 20 x 21'):
            relearner.learn(Episode.at(tmp_path / 'task1' / '0001_demo'))

    def test_a_bag_of_others_and_one_of_another_version(self, tmp_path):
        task = TaskFolder(tmp_path, 'task1')
        header = EpisodeHeader('trial', 'task1', GRID).to_mapping()
        for values in ({}, header | {'version': '2'}, header):
            with start_bag(task, 'demo', values) as bag:
                write_drive(bag, 2)
        for episode, sentence in zip(task.episodes(), (
                'version of the bag is missing, must be 1', 'version of the bag is 2, must be 1',
                'holds a trial, its name says demo'), strict=True):
            with pytest.raises(BagError, match=sentence):
                content_of(episode.path)

    def test_several_topics_for_one_role(self):
        topics = {'/a/odom': ODOMETRY, '/b/odom': ODOMETRY, '/c/trial': STATUS}
        assert find_topic(topics, 'trial', {}) == '/c/trial'
        assert find_topic(topics, 'odom', {'odom': '/b/odom'}) == '/b/odom'
        assert find_topic(topics, 'experience', {}) == '/experience'
        with pytest.raises(BagError, match=r'odom may be /a/odom or /b/odom: name one'):
            find_topic(topics, 'odom', {})


class TestExternalBags:
    """Bags of other recorders."""

    @pytest.mark.parametrize('storage', list(StoragePlugin), ids=str)
    @pytest.mark.parametrize(
        'compression', [None, CompressionMode.MESSAGE, CompressionMode.FILE], ids=str)
    def test_they_are_learnt_from(self, tmp_path, storage, compression):
        path = external_bag(tmp_path / 'bag', storage, compression)
        demonstration, report, notes = external_demonstration(path, GRID, EXTERNAL, 7)
        assert demonstration.cells[0].tolist() == [2, 2]
        assert demonstration.cells[-1].tolist() == [2, 9]
        assert (demonstration.episode, report.n_poses, notes) == (7, 200, ())
        assert (demonstration.unknown == 255).all()

    def test_a_bag_of_ours_is_one_too(self, tmp_path):
        folder = demonstration_bag(tmp_path)
        for path in (folder, mcap_path(folder)):
            demonstration, *_ = external_demonstration(path, GRID)
            np.testing.assert_array_equal(
                demonstration.cells, content_of(folder).record.cells)

    def test_a_topic_that_is_not_there_is_named(self, tmp_path):
        path = external_bag(tmp_path / 'bag', StoragePlugin.SQLITE3)
        with pytest.raises(BagError, match=r'no topic /odom \(odom\), there are /wheel/odometry'):
            external_demonstration(path, GRID, {'odom': '/odom'})
        with pytest.raises(BagError, match=r'/cmd_vel is geometry_msgs/msg/Twist, odom must be'):
            external_demonstration(path, GRID, {'odom': '/cmd_vel'})

    def test_another_frame_is_named(self, tmp_path):
        path = external_bag(tmp_path / 'bag', StoragePlugin.MCAP, frame='map')
        with pytest.raises(BagError, match="frame is 'map', must be 'odom'"):
            external_demonstration(path, GRID, EXTERNAL)

    def test_what_is_no_bag_is_said_in_a_line(self, tmp_path):
        (tmp_path / 'bag.db3').write_bytes(b'SQLite format 3\0' + bytes(100))
        (tmp_path / 'bag.mcap').write_bytes(b'poem')
        (tmp_path / 'empty').mkdir()
        for name in ('bag.db3', 'bag.mcap', 'empty', 'none', 'none.mcap', 'none.db3'):
            with pytest.raises(BagError, match=r'^cannot read [^\n]+$'):
                open_bag(tmp_path / name).messages('/odom')


def test_ten_minutes_at_50_hz_are_read_in_a_blink(tmp_path):
    folder = demonstration_bag(tmp_path, n=30_000, rate=1e4)
    took = []
    for _ in range(5):
        start = time.process_time()
        bag = open_bag(folder)
        poses = pose_table(bag.messages('/odom'), 'odom')
        local_grids = local_grid_table(bag.messages('/neighbourhood'), GRID)
        took.append(time.process_time() - start)
        assert len(poses.stamps) == len(local_grids.stamps) == 30_000
    # 0.04 s on a machine that is free; others may be at work on this one.
    assert min(took) < 0.2


def test_a_bag_whose_folder_was_renamed_says_so(tmp_path):
    """It was passed over as one whose recorder was stopped at once."""
    folder = demonstration_bag(tmp_path)
    renamed = folder.rename(folder.with_name('0004_demo'))
    with pytest.raises(BagError, match=r'holds 0001_demo_0\.mcap and no 0004_demo_0') as held:
        content_of(renamed)
    assert not isinstance(held.value, NothingToLearnError)


def test_another_recording_beside_that_of_a_bag_is_named(tmp_path):
    folder = demonstration_bag(tmp_path)
    before = content_of(folder).notes
    for name in ('0001_demo_1.mcap', 'other.db3'):
        (folder / name).write_bytes(b'whatever')
    assert content_of(folder).notes == (
        *before, '0001_demo_1.mcap lies beside it and is not read',
        'other.db3 lies beside it and is not read')
