"""The memory of a task: bags in, fields out; no ROS running."""

import resource
import time

import pytest

from bridge_helpers import demonstration_bag, GRID, loop_bag
from control_field.parameters import Parameters
from control_field.poses import StartPose
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder
from learner_node.learning.task_memory import set_aside, TaskMemory
from msgs_bridge.messages.trial_status import Label


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

    def test_learning_takes_a_tenth_of_a_second_of_the_processor_at_most(self, tmp_path):
        for _ in range(3):
            loop_bag(tmp_path)
        episodes = TaskFolder(tmp_path, 'task1').episodes()
        task_memory, took = TaskMemory(TaskFolder(tmp_path, 'task1'), GRID, Parameters()), []
        for episode in episodes:
            began = time.process_time()
            task_memory.learn(episode)
            took.append(time.process_time() - began)
        assert min(took) < 0.1

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
        task_memory.drop()
        assert task_memory.field().q.tobytes() == field

    def test_drops_the_newest_bag(self, task):
        field = task_memory_of(task).field().q.tobytes()
        demonstration_bag(task.root, n=300)
        task_memory = task_memory_of(task)
        assert task_memory.field().q.tobytes() != field
        more = task_memory.field().q.tobytes()
        assert 'task1/0002 is dropped (press b in teleop_node' in task_memory.drop()
        assert task_memory.field().q.tobytes() == field
        assert 'task1/0002 is back' in task_memory.undo()
        assert task_memory.field().q.tobytes() == more
        with pytest.raises(BagError, match='nothing was taken away'):
            task_memory.undo()

    def test_heeds_labels(self, task):
        task_memory = task_memory_of(task)
        assert 'Nothing is left' in task_memory.label(Label.FAILURE)
        assert task_memory.refresh is None
        task_memory.label(Label.SUCCESS)
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
            task_memory.drop() if change == 'drop' else task_memory.label(Label.FAILURE)
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
