"""`experience learn` on bags of other recorders, written by `rosbags`; nodes start from them."""

import shutil

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from sensor_msgs.msg import PointCloud2

from bridge_helpers import content_of, demonstration_bag, GRID, loop_bag, nanoseconds
from episode_store.episode import Episode
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import TaskFolder
from experience_cli.commands.learn import digest as digest_of
from experience_cli.main import main
from external_bags import drive_bag, N_POSES, ros1_bag
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from ros_helpers import collect, start_node, wait_until
from sample_helpers import files_of


def learn(*arguments):
    return main(['learn', *map(str, arguments)])


NAMES = {'odom': '/tb3/wheel/odometry', 'cmd_vel': '/tb3/teleop/command',
         'neighbourhood': '/tb3/local/around'}
OPTIONS = ('--odom-topic', NAMES['odom'], '--cmd-vel-topic', NAMES['cmd_vel'],
           '--neighbourhood-topic', NAMES['neighbourhood'])


@pytest.mark.parametrize(('storage', 'compression'), [
    (StoragePlugin.SQLITE3, None), (StoragePlugin.MCAP, None),
    (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    (StoragePlugin.SQLITE3, CompressionMode.FILE), (StoragePlugin.MCAP, CompressionMode.FILE)])
def test_a_drive_of_another_robot_teaches(tmp_path, capsys, storage, compression):
    bag = drive_bag(tmp_path / 'rosbag2_2025', NAMES, storage, compression)
    assert learn(bag, *OPTIONS, '--save', tmp_path / 'field.npz') == 0
    line, last = capsys.readouterr().out.splitlines()
    assert 'is learnt: 8 steps. The workspace fits the drive: 24 x 32 cells of 0.25 m' in line
    assert last.startswith('control_field revision 1 sha256 ')
    with np.load(tmp_path / 'field.npz') as saved:
        # The local grids that were recorded say what the cells are: (0, 0) is a corner of four.
        assert saved['origin'].tolist() == [-2.0, -2.0]
        assert saved['goal'].tolist() == [10, 18]
        assert (saved['known'][9:12, 10:19] == 0).all()


def test_topics_that_are_called_so_need_no_name(tmp_path, capsys):
    bag = drive_bag(tmp_path / 'bag', {'odom': '/r1/odom', 'cmd_vel': '/r1/cmd_vel'})
    assert learn(bag, '--rows', 10, '--cols', 12) == 0
    only = drive_bag(tmp_path / 'only', {'odom': '/pose/filtered'})
    assert learn(only, '--rows', 10, '--cols', 12) == 0
    outputs = capsys.readouterr().out.splitlines()
    assert outputs[1] == outputs[3]


def test_the_workspace_can_be_told_or_be_that_of_another_bag(tmp_path, capsys):
    bag = drive_bag(tmp_path / 'bag', {'odom': '/odom'}, frame='map')
    assert learn(bag, '--frame', 'map', '--resolution', 0.5, '--origin', -1, -1.5, '--rows', 9,
                 '--cols', 20, '--save', tmp_path / 'field.npz') == 0
    with np.load(tmp_path / 'field.npz') as saved:
        assert saved['origin'].tolist() == [-1.0, -1.5]
        assert saved['resolution'] == 0.5
    ours = demonstration_bag(tmp_path / 'bags')
    bag = drive_bag(tmp_path / 'like', {'odom': '/odom'})
    assert learn(bag, '--like', ours, '--save', tmp_path / 'field.npz') == 0
    with np.load(tmp_path / 'field.npz') as saved:
        assert saved['resolution'] == GRID.resolution


class TestInto:

    def test_it_becomes_the_next_demonstration_bytes_as_they_are(self, tmp_path, capsys):
        bag = drive_bag(tmp_path / 'their_bag', NAMES, StoragePlugin.SQLITE3)
        assert learn(bag, *OPTIONS, '--into', tmp_path / 'bags' / 'shelf') == 0
        assert learn(bag, *OPTIONS, '--into', tmp_path / 'bags' / 'shelf') == 0
        task = TaskFolder(tmp_path / 'bags', 'shelf')
        first, second = task.episodes()
        assert (first.path.name, second.path.name) == ('0001_demo', '0002_demo')
        raw = BagReader(first.bag).messages(NAMES['odom'])
        assert list(raw) == list(open_bag(bag).messages(NAMES['odom']))
        assert len(raw) == N_POSES
        assert raw.log_times.tolist() == [nanoseconds(i / 20) for i in range(N_POSES)]
        header = Episode.at(first.path).header
        assert (header.topics, header.task) == (NAMES, 'shelf')
        assert len(content_of(first.path).record.cells) == 9
        assert f'{bag} is kept as {first.path}' in capsys.readouterr().out

    def test_a_task_keeps_its_workspace(self, tmp_path, capsys, mistake):
        demonstration_bag(tmp_path / 'bags')
        bag = drive_bag(tmp_path / 'bag', {'odom': '/odom'})
        task = TaskFolder(tmp_path / 'bags', 'task1')
        line = mistake('learn', bag, '--into', task.path, '--rows', 7)
        assert '--rows' in line
        assert learn(bag, '--into', task.path) == 0
        assert capsys.readouterr().out.splitlines()[-1].startswith('control_field revision 2')

    def test_a_drive_that_leaves_the_workspace_of_a_task_lets_it_grow(
            self, tmp_path, capsys, mistake):
        task = demonstration_bag(tmp_path / 'bags').parent
        bag = ros1_bag(tmp_path / 'far.bag', n=500)
        line = mistake('learn', bag, '--into', task, '--like', task)
        assert 'leaves the workspace' in line
        assert 'without --rows, --cols, --origin and --like' in line
        assert learn(bag, '--into', task) == 0
        assert f'it leaves the workspace there was, {GRID.size}' in capsys.readouterr().out
        header = Episode.at(task / '0002_demo').header
        assert header.fitted
        assert header.grid.offset_to(GRID) is not None
        assert learn(task, '--save', tmp_path / 'field.npz') == 0
        with np.load(tmp_path / 'field.npz') as saved:
            size = np.array(saved['vx'].shape) * saved['resolution']
            assert (saved['origin'] + size[::-1] > [10.5, 0.6]).all()

    def test_bags_of_one_lattice_grow_into_one_field(self, tmp_path, capsys):
        """However they are learnt: in one go, kept one by one, or relearnt."""
        near, far = ros1_bag(tmp_path / 'a.bag'), ros1_bag(tmp_path / 'b.bag', n=500)
        assert learn(near, far) == 0
        shas = [capsys.readouterr().out.split()[-1]]
        for bag in (near, far):
            assert learn(bag, '--into', tmp_path / 'bags' / 'task') == 0
        shas.append(capsys.readouterr().out.split()[-1])
        assert learn(tmp_path / 'bags' / 'task') == 0
        shas.append(capsys.readouterr().out.split()[-1])
        assert len({*shas}) == 1

    @pytest.mark.parametrize('name', [
        'bags/s/0001_demo', 'bags/s/0001_demo/x', 'bags/s/0009_trial', 'whole', 'mcap', 'db3'])
    def test_a_bag_is_no_task(self, tmp_path, mistake, monkeypatch, name):
        monkeypatch.chdir(tmp_path)
        bag = drive_bag(tmp_path / 'theirs', {'odom': '/odom'})
        assert learn(bag, '--into', 'bags/s', '--quiet') == 0
        shutil.copytree(bag, 'whole')
        for ending in ('mcap', 'db3'):
            (tmp_path / ending).mkdir()
            (tmp_path / ending / f'drive_0.{ending}').touch()
        files = files_of(tmp_path)
        line = mistake('learn', bag, '--into', name)
        assert line.startswith(f'experience learn: --into {name}: ')
        assert 'is a bag' in line
        assert 'the folder of a task' in line
        assert files_of(tmp_path) == files

    def test_a_new_task_whose_name_is_nearly_an_old_one_asks(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'theirs', {'odom': '/odom'})
        assert learn(bag, '--into', tmp_path / 'bags' / 'kitchen') == 0
        line = mistake('learn', bag, '--into', tmp_path / 'bags' / 'kichen')
        assert f'--into {tmp_path}/bags/kitchen, or --new-task if a new one is meant' in line
        assert not (tmp_path / 'bags' / 'kichen').exists()
        assert learn(bag, '--into', tmp_path / 'bags' / 'kitchen2') == 0
        for name in ('kichen', 'kichen', 'kitchen'):
            assert learn(bag, '--into', tmp_path / 'bags' / name, '--new-task') == 0

    def test_a_task_may_lie_beside_the_files_of_others(self, tmp_path, monkeypatch):
        drive_bag(tmp_path / 'theirs', {'odom': '/odom'})
        monkeypatch.chdir(tmp_path / 'theirs')
        assert learn('theirs.mcap', '--into', 'task', '--quiet') == 0

    def test_what_teaches_nothing_leaves_nothing(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'bag', {'odom': '/odom'}, frame='map')
        line = mistake('learn', bag, '--into', tmp_path / 'bags' / 'task', '--frame', 'odom')
        assert "frame is 'map', must be 'odom'" in line
        assert line.endswith('if that is the right one, learn it with --frame map')
        assert not TaskFolder(tmp_path / 'bags', 'task').episodes()

    def test_unless_all_of_them_can_be_kept_none_is(self, tmp_path, capsys, mistake):
        good = drive_bag(tmp_path / 'good', {'odom': '/odom'})
        other = drive_bag(tmp_path / 'other', {'odom': '/tb3/odometry'})
        far = drive_bag(tmp_path / 'far', {'odom': '/odom'}, frame='map')  # after one in odom
        task = tmp_path / 'bags' / 'task'
        for bad, why in ((other, 'no topic /odom'), (far, "frame is 'map'"),
                         (tmp_path / 'none', 'there is no bag')):
            line = mistake('learn', good, bad, '--odom-topic', '/odom', '--into', task)
            assert why in line
            assert str(bad) in line
            assert not TaskFolder(task.parent, task.name).episodes()
        assert learn(good, good, '--odom-topic', '/odom', '--into', task) == 0
        assert capsys.readouterr().out.startswith(f'{good} is kept as {task / "0001_demo"}')

    def test_a_drive_that_ends_where_it_began_is_not_kept(self, tmp_path, mistake):
        bag = loop_bag(tmp_path / 'theirs')
        line = mistake('learn', bag, '--into', tmp_path / 'bags' / 'task')
        assert 'ends in the cell where it began' in line
        assert not TaskFolder(tmp_path / 'bags', 'task').episodes()
        assert 'ends in the cell where it began' in mistake('learn', bag, '--odom-topic', '/odom')

    def test_the_learner_starts_from_it(self, tmp_path, capsys, ros_domain, ros_node):
        bag = drive_bag(tmp_path / 'bag', NAMES, StoragePlugin.SQLITE3)
        assert learn(bag, *OPTIONS, '--into', tmp_path / 'bags' / 'task') == 0
        digest = capsys.readouterr().out.split()[-1]
        fields = collect(ros_node, PointCloud2, 'control_field', qos.LATCHED)
        with start_node('learner_node.node', tmp_path,
                        {'bags': str(tmp_path / 'bags')}) as process:
            wait_until(lambda: fields, node=ros_node, processes=[process], what='the field')
        assert digest_of(field_from_cloud(fields[-1])) == digest


class TestMistakes:

    def test_a_topic_that_is_not_there(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'bag', {'odom': '/a/one', 'other': '/b/two', 'cmd_vel': '/go'})
        line = mistake('learn', bag, '--odom-topic', '/odom')
        assert 'no topic /odom (odom), there are /a/one (Odometry), /b/two (Odometry)' in line
        assert '/go' not in line
        line = mistake('learn', bag, '--cmd-vel-topic', '/go', '--odom-topic', '/a/one',
                       '--neighbourhood-topic', '/near')
        assert 'none of type nav_msgs/msg/OccupancyGrid (topics: ' in line
        assert '/b/two (nav_msgs/msg/Odometry), /go (geometry_msgs/msg/Twist))' in line

    def test_a_topic_of_another_type(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'bag', {'odom': '/odom', 'cmd_vel': '/cmd_vel'})
        line = mistake('learn', bag, '--odom-topic', '/cmd_vel')
        assert '/cmd_vel is geometry_msgs/msg/Twist' in line
        assert 'there are /odom (Odometry)' in line

    def test_none_that_may_be_meant(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'bag', {'cmd_vel': '/cmd_vel'})
        line = mistake('learn', bag, '--rows', 9, '--cols', 9)
        assert 'no topic is odom, there are none of type nav_msgs/msg/Odometry or' in line
        assert '(topics: /cmd_vel (geometry_msgs/msg/Twist))' in line
        assert mistake('learn', bag) == line

    def test_several_that_may_be_meant(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'bag', {'odom': '/a/odom', 'other': '/b/odom'})
        for options in ([], ['--rows', 9, '--cols', 9]):
            line = mistake('learn', bag, *options)
            assert line.endswith('which topic is odom? Name one of /a/odom (Odometry), /b/odom '
                                 '(Odometry) with --odom-topic')

    @pytest.mark.parametrize(('options', 'words'), [
        (['--rows', 0, '--cols', 1], ['rows', '1 to']), (['--rows', 5], ['--rows', '--cols']),
        (['--cols', 5], ['--rows', '--cols']), (['--origin', 0, 0], ['--origin', '--rows']),
        (['--resolution', -1], ['resolution', 'above 0']),
        (['--frame', 'odom', '--check'], ['--check']),
        (['--into', '../../x y'], ['x y', 'letters']),
        (['--like', 'nope'], ['nope'])])
    def test_arguments(self, tmp_path, mistake, options, words):
        bag = drive_bag(tmp_path / 'bag', {'odom': '/odom'})
        line = mistake('learn', bag, *options)
        for word in words:
            assert word in line

    def test_no_bag_at_all(self, tmp_path, mistake):
        assert 'there is no bag' in mistake('learn', tmp_path / 'none', '--frame', 'odom')
        (tmp_path / 'empty').mkdir()
        assert 'cannot read' in mistake('learn', tmp_path / 'empty', '--frame', 'odom')
        (tmp_path / 'empty' / 'x.mcap').touch()
        assert mistake('learn', tmp_path / 'empty').endswith('empty/x.mcap: it is empty')

    def test_bags_of_ours_and_of_others_in_one_go(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'rosbag2_2025', {'odom': '/odom'})
        ours = demonstration_bag(tmp_path / 'bags')
        for paths in ([bag, ours], [ours.parent, bag]):
            line = mistake('learn', *paths)
            assert f'{bag} is a bag of another recorder' in line
            assert '--into' in line

    def test_a_folder_that_mixes_ours_and_others_is_a_task_of_ours(self, tmp_path, capsys):
        ours = demonstration_bag(tmp_path / 'bags').parent
        assert learn(ours) == 0
        alone = capsys.readouterr().out
        drive_bag(ours / 'rosbag2_2025', {'odom': '/odom'})
        assert learn(ours) == 0
        assert capsys.readouterr().out == alone

    def test_a_folder_of_bags_of_others(self, tmp_path, mistake):
        bag = drive_bag(tmp_path / 'rosbag2_2025', {'odom': '/odom'})
        line = mistake('learn', tmp_path)
        assert 'holds no bags, must be a folder of bags like 0001_demo; name those of' in line
        assert line.endswith(f'one by one, such as {bag}')
