"""The memory of a task, its recorder and the worker: files in, fields out; no ROS running."""

import resource
import threading
import tracemalloc

import pytest

from bridge_helpers import demonstration_bag, GRID, loop_bag
from control_field.parameters import Parameters
from control_field.poses import StartPose
from episode_store.episode import Episode
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import EpisodeKind, TaskFolder
from learner_node.message_queue import RawMessage
from learner_node.recorder import Recorder, stamp_of
from learner_node.settings import Settings, start_poses_from_list
from learner_node.task_memory import set_aside, TaskMemory
from learner_node.worker import result_of, Worker
from msgs_bridge.messages.trial_status import Label
from ros_helpers import wait_until


@pytest.fixture
def task(tmp_path):
    """Return a task with one demonstration."""
    demonstration_bag(tmp_path)
    return TaskFolder(tmp_path, 'task1')


def task_memory_of(task, **more):
    task_memory = TaskMemory(task, GRID, Parameters(), **more)
    task_memory.lines = task_memory.relearn()
    return task_memory


class TestTaskMemory:

    def test_begins_with_the_bags_that_it_finds(self, task):
        task_memory = task_memory_of(task)
        assert task_memory.refresh.field.revision == 1
        assert '1 demonstration and 0 trials' in task_memory.lines[-1]

    def test_counts_what_was_learnt_from(self, task):
        task.new_episode('demo')
        assert '1 demonstration and 0 trials' in task_memory_of(task).lines[-1]

    def test_relearning_changes_nothing(self, task):
        task_memory = task_memory_of(task)
        before = task_memory.field().q.tobytes()
        task_memory.relearn()
        assert task_memory.field().q.tobytes() == before

    def test_mends_what_was_cut_and_says_so(self, task):
        bag = task.find(1).bag
        bag.write_bytes(bag.read_bytes()[:-3000])
        assert 'mended' in task_memory_of(task).lines[0]

    def test_learns_from_what_was_cut_where_it_cannot_be_mended(self, task):
        bag = task.find(1).bag
        bag.write_bytes(bag.read_bytes()[:-3000])
        cut = bag.read_bytes()
        task_memory = TaskMemory(task, GRID, Parameters())
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        # No file of this process may be greater; the error is much the same as of a full disk.
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
        try:
            task_memory.relearn()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert task_memory.refresh is not None
        assert bag.read_bytes() == cut
        [doubt] = task_memory.doubts
        assert 'cannot repair' in doubt
        assert 'learnt from as it is' in doubt

    def test_says_once_which_parameters_the_bags_were_not_recorded_with(self, task):
        assert task_memory_of(task).doubts == []
        task_memory = TaskMemory(task, GRID, Parameters(power=3.0, moves=4))
        task_memory.relearn()
        [doubt] = task_memory.doubts
        assert doubt.startswith('task1/0001 ')
        assert doubt.endswith(': power: 2.0 -> 3.0, moves: 8 -> 4')
        task_memory.relearn()
        assert task_memory.doubts == []

    def test_starts_where_it_was_shown(self, task):
        task_memory = task_memory_of(task)
        start = task_memory.next_start(spread=False)
        assert GRID.cell_from_world(start.x, start.y) == (2, 2)

    def test_starts_where_it_is_told_in_turn(self, task):
        poses = (StartPose(1.0, 1.0), StartPose(2.0, 2.0))
        task_memory = task_memory_of(task, starts=poses)
        assert [task_memory.next_start(False) for _ in range(3)] == [*poses, poses[0]]

    def test_spread_starts_lie_in_the_workspace(self, task):
        task_memory = task_memory_of(task)
        starts = [task_memory.next_start(spread=True) for _ in range(5)]
        assert all(GRID.contains(*GRID.cell_from_world(s.x, s.y)) for s in starts)
        assert len({(s.x, s.y) for s in starts}) > 1

    def test_has_no_start_before_it_was_shown_anything(self, tmp_path):
        with pytest.raises(ValueError, match='nothing was demonstrated'):
            task_memory_of(TaskFolder(tmp_path, 'new')).next_start(False)

    def test_fresh_sets_the_old_bags_aside_and_undo_brings_them_back(self, task):
        field = task_memory_of(task).field().q.tobytes()
        demonstration_bag(task.root)
        task_memory = task_memory_of(task, fresh=True)
        assert task_memory.refresh is None
        assert not task.episodes()
        assert 'task1/0001 and task1/0002 are set aside' in task_memory.lines[0]
        assert 'press b in teleop_node' in task_memory.lines[0]
        assert set_aside(task) == ''
        assert task_memory.undo().startswith('task1/0001 and task1/0002 are back. ')
        task_memory.drop_last()
        assert task_memory.field().q.tobytes() == field

    def test_drops_the_newest_bag(self, task):
        field = task_memory_of(task).field().q.tobytes()
        demonstration_bag(task.root, n=300)
        task_memory = task_memory_of(task)
        assert task_memory.field().q.tobytes() != field
        more = task_memory.field().q.tobytes()
        assert 'task1/0002 is dropped (press b in teleop_node' in task_memory.drop_last()
        assert task_memory.field().q.tobytes() == field
        assert 'task1/0002 is back' in task_memory.undo()
        assert task_memory.field().q.tobytes() == more
        with pytest.raises(BagError, match='nothing was taken away'):
            task_memory.undo()

    def test_heeds_labels(self, task):
        task_memory = task_memory_of(task)
        assert 'Nothing is left' in task_memory.label_last(Label.FAILURE)
        assert task_memory.refresh is None
        task_memory.label_last(Label.SUCCESS)
        assert task_memory.refresh is not None

    def test_a_drive_that_teaches_nothing_leaves_the_task_usable(self, task):
        field = task_memory_of(task).field().q.tobytes()
        loop_bag(task.root)
        task_memory = task_memory_of(task)
        assert task_memory.field().q.tobytes() == field
        assert 'task1/0002: nothing was learnt: nothing to learn from this' in task_memory.lines[0]

    @pytest.mark.parametrize('change', ['drop', 'label'])
    def test_a_change_that_cannot_be_relearnt_leaves_the_field_in_force(self, task, change):
        for n in (300, 250):
            demonstration_bag(task.root, n)
        task_memory = task_memory_of(task)
        before = task_memory.field().q.tobytes()
        task.find(1).bag.write_bytes(b'no bag at all')
        with pytest.raises(BagError, match='but the control field stays as it was'):
            task_memory.drop_last() if change == 'drop' else task_memory.label_last(Label.FAILURE)
        assert task_memory.field().q.tobytes() == before

    def test_the_field_in_force_stays_until_all_bags_are_relearnt(self, task):
        task_memory = task_memory_of(task)
        held = []

        class Slow(TaskFolder):
            def episodes(self):
                held.append(task_memory.refresh)
                return super().episodes()

        task_memory.task = Slow(task.root, task.task)
        task_memory.relearn()
        assert len(held) > 1
        assert None not in held


def raw_bool(topic, cdr, stamp):
    return RawMessage(topic, 'std_msgs/msg/Bool', cdr, stamp)


def record(recorder, name, message):
    """Let a message arrive, and take it."""
    recorder.arrived(name, message)
    recorder.take()


class TestRecorder:

    def test_begins_with_what_is_latched_and_was_seen_last(self, tmp_path):
        task_memory = task_memory_of(TaskFolder(tmp_path, 'task1'))
        recorder = Recorder(task_memory.task, task_memory.header)
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
        task_memory = task_memory_of(TaskFolder(tmp_path, 'task1'))
        recorder = Recorder(task_memory.task, task_memory.header)
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
        task_memory = task_memory_of(TaskFolder(tmp_path, 'task1'))
        recorder = Recorder(task_memory.task, task_memory.header)
        recorder.start(EpisodeKind.DEMO, 0)
        for stamp in range(200):
            record(recorder, 'experience', raw_bool('/e', b'\0\1\0\0\1', stamp))
        recorder.close()
        trial = recorder.start(EpisodeKind.TRIAL, 300)
        record(recorder, 'experience', raw_bool('/e', b'\0\1\0\0\1', 301))
        recorder.close()
        assert [sent for *_, sent, _ in BagReader(trial.bag).records()] == [*range(200), 301]

    def test_keeps_no_more_than_a_few_megabytes_for_a_trial_to_come(self, tmp_path):
        task_memory = task_memory_of(TaskFolder(tmp_path, 'task1'))
        recorder = Recorder(task_memory.task, task_memory.header)
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

    def test_leaves_nothing_of_what_is_discarded(self, tmp_path):
        task_memory = task_memory_of(TaskFolder(tmp_path, 'task1'))
        recorder = Recorder(task_memory.task, task_memory.header)
        recorder.start(EpisodeKind.DEMO, 0)
        recorder.discard()
        assert recorder.close() is None
        assert recorder.kind is None
        assert not task_memory.task.episodes()


@pytest.mark.parametrize(('cdr', 'stamp'), [
    (b'\0\1\0\0' + b'\2\0\0\0' + b'\3\0\0\0', 2_000_000_003),
    (b'\0\0\0\0' + b'\0\0\0\2' + b'\0\0\0\3', 2_000_000_003),
    (b'\0\1\0\0' + b'\xff' * 8, 3_294_967_295), (b'\0\1', 0), (b'', 0)])
def test_stamps_are_read_from_whatever_arrives(cdr, stamp):
    assert stamp_of(cdr) == stamp


class TestSettings:

    def test_start_poses_come_in_threes(self):
        assert start_poses_from_list([1, 2, 0.5], GRID) == (StartPose(1.0, 2.0, 0.5),)
        assert start_poses_from_list(None, GRID) == ()

    @pytest.mark.parametrize('values', [[1.0], [1.0, float('nan'), 0.0], [-1.0, 1.0, 0.0]])
    def test_start_poses_that_are_none_are_refused(self, values):
        with pytest.raises(ValueError, match='start_poses'):
            start_poses_from_list(values, GRID)

    def test_lock_step_means_stamped_commands(self):
        assert Settings(lockstep=True).is_stamped
        assert not Settings().is_stamped

    def test_a_task_cannot_lead_out_of_the_bags(self):
        with pytest.raises(BagError, match='task'):
            Settings(task='../x')


class TestWorker:

    def test_hands_results_to_whom_collects_them(self):
        worker, woken, got = Worker(), threading.Event(), []
        worker.wake = woken.set
        worker.do(threading.get_ident, got.append)
        assert woken.wait(5.0)
        assert got == []
        worker.collect()
        assert got[0].result() != threading.get_ident()
        assert worker.close(5.0)

    def test_hands_over_errors_and_goes_on(self):
        worker, got = Worker(), []
        worker.do(lambda: 1 / 0, got.append)
        worker.do(lambda: 2, got.append)
        assert worker.close(5.0)
        worker.collect()
        assert isinstance(got[0].exception(), ZeroDivisionError)
        assert got[1].result() == 2

    def test_a_mistake_of_ours_is_one_line_and_logged_with_its_place(self):
        worker, got, logged = Worker(), [], []
        worker.do(lambda: 1 / 0, got.append)
        assert worker.close(5.0)
        worker.collect()
        with pytest.raises(BagError, match=r'^a mistake .*ZeroDivisionError: division by zero$'):
            result_of(got[0], logged.append)
        assert 'test_task_memory.py' in logged[0]

    def test_does_not_wait_for_ever(self):
        worker, limit_command = Worker(), threading.Event()
        worker.do(limit_command.wait, lambda future: None)
        assert not worker.close(0.01)
        limit_command.set()
