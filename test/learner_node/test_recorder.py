"""The recorder: what goes into which bag, in which order, and what is lost."""

import errno
import os
import tracemalloc

import pytest

from bridge_helpers import GRID
from control_field.parameters import Parameters
from episode_store.episode import Episode
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.writer import McapFile
from episode_store.task_folder import EpisodeKind, TaskFolder
from learner_node.learning.task_memory import TaskMemory
from learner_node.recording.message_queue import RawMessage
from learner_node.recording.recorder import Recorder, stamp_of
from ros_helpers import wait_until


def recorder_in(folder):
    task_memory = TaskMemory(TaskFolder(folder, 'task1'), GRID, Parameters())
    return Recorder(task_memory.task, task_memory.header)


def raw_bool(topic, cdr, stamp):
    return RawMessage(topic, 'std_msgs/msg/Bool', cdr, stamp)


def record(recorder, name, message):
    """Let a message arrive, and take it."""
    recorder.arrived(name, message)
    recorder.take()


def no_space(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


class TestRecorder:

    def test_begins_with_what_is_latched_and_was_seen_last(self, tmp_path):
        recorder = recorder_in(tmp_path)
        recorder.latched = [raw_bool('/contact', b'\0\1\0\0\1', 1)]
        for stamp in (1, 2):
            record(recorder, 'neighbourhood',
                raw_bool('/map', b'\0\1\0\0\0', stamp))
        record(recorder, 'odom', raw_bool('/odom', b'\0\1\0\0\0', 3))
        episode = recorder.start(EpisodeKind.DEMO, 5)
        record(recorder, 'odom', raw_bool('/odom', b'\0\1\0\0\1', 6))
        assert recorder.close() == episode
        records = list(BagReader(episode.bag).records())
        # Who plays it does not wait from when the field was sent until the bag begins.
        assert [(channel.topic, log, sent) for channel, log, sent, _ in records] == [
            ('/contact', 5, 1), ('/map', 5, 2), ('/odom', 6, 6)]

    def test_writes_what_waits_for_long_and_takes_back_what_came_after_the_end(self, tmp_path):
        recorder = recorder_in(tmp_path)
        first = recorder.start(EpisodeKind.DEMO, 0)
        for stamp in range(6):
            recorder.arrived('odom', raw_bool('/odom', b'\0\1\0\0\0', stamp))
        recorder.take()

        def catch_up():
            recorder.catch_up()
            return len(list(BagReader(first.bag).records())) == 6

        wait_until(catch_up, what='what waits in the bag')
        # The session, once it goes on, ends the bag behind the third and begins the next there.
        recorder.take()
        recorder.take()
        recorder.close()
        second = recorder.start(EpisodeKind.TRIAL, 9)
        while recorder.oldest():
            recorder.take()
        recorder.close()
        found = [[sent for *_, sent, _ in BagReader(episode.bag).records()]
                 for episode in (first, second)]
        assert found == [[0, 1, 2], [3, 4, 5]]
        assert Episode(first).is_closed

    def test_keeps_the_decisions_of_a_trial_that_starts_during_a_demonstration(self, tmp_path):
        recorder = recorder_in(tmp_path)
        recorder.start(EpisodeKind.DEMO, 0)
        for stamp in range(200):
            record(recorder, 'experience', raw_bool('/e', b'\0\1\0\0\1', stamp))
        recorder.close()
        trial = recorder.start(EpisodeKind.TRIAL, 300)
        record(recorder, 'experience', raw_bool('/e', b'\0\1\0\0\1', 301))
        recorder.close()
        assert [sent for *_, sent, _ in BagReader(trial.bag).records()] == [*range(200), 301]

    def test_keeps_no_more_than_a_few_megabytes_for_a_trial_to_come(self, tmp_path):
        recorder = recorder_in(tmp_path)
        size = 500_000
        tracemalloc.start()
        try:
            for stamp in range(100):
                record(recorder, 'experience',
                    raw_bool('/e', bytes(size), stamp))
            record(recorder, 'experience', raw_bool('/e', bytes(20 * size), 100))
            held, _ = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert held < 10 * size
        trial = recorder.start(EpisodeKind.TRIAL, 300)
        recorder.close()
        assert [sent for *_, sent, _ in BagReader(trial.bag).records()] == [*range(92, 100)]

    @pytest.mark.parametrize('is_told_late', [False, True])
    def test_a_bag_that_cannot_be_written_is_said_once_though_messages_were_lost(
            self, tmp_path, monkeypatch, is_told_late):
        recorder = recorder_in(tmp_path)
        episode = recorder.start(EpisodeKind.DEMO, 0)
        record(recorder, 'odom', raw_bool('/odom', b'\0\1\0\0\1', 1))
        recorder.flush()
        recorder.lost['/odom'] += 1
        monkeypatch.setattr(McapFile, 'flush', no_space)
        monkeypatch.setattr(McapFile, 'add_metadata', no_space)
        if is_told_late:  # what failed while the session was held up comes out at the end
            monkeypatch.setattr('learner_node.recording.recorder._PATIENCE', 0.0)
            recorder.arrived('odom', raw_bool('/odom', b'\0\1\0\0\1', 2))
            recorder.catch_up()
        with pytest.raises(BagError, match='no space left'):
            recorder.close() if is_told_late else recorder.flush()
        assert recorder.close() is None
        recorder.flush()
        assert len(list(BagReader(episode.bag).records())) == 1

    def test_leaves_nothing_of_what_is_discarded(self, tmp_path):
        recorder = recorder_in(tmp_path)
        recorder.start(EpisodeKind.DEMO, 0)
        recorder.discard()
        assert recorder.close() is None
        assert recorder.kind is None
        assert not recorder.task.episodes()


@pytest.mark.parametrize(('cdr', 'stamp'), [
    (b'\0\1\0\0' + b'\2\0\0\0' + b'\3\0\0\0', 2_000_000_003),
    (b'\0\0\0\0' + b'\0\0\0\2' + b'\0\0\0\3', 2_000_000_003),
    (b'\0\1\0\0' + b'\xff' * 8, 3_294_967_295), (b'\0\1', 0), (b'', 0)])
def test_stamps_are_read_from_whatever_arrives(cdr, stamp):
    assert stamp_of(cdr) == stamp
