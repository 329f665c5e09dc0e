"""`experience learn` on bags of other recorders, written by `rosbags`; nodes start from them."""

import shutil

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from sensor_msgs.msg import PointCloud2

from bridge_helpers import (
    content_of, demonstration_bag, GRID, loop_bag, nanoseconds, ODOMETRY, raw_local_grid,
    raw_odometry)
from episode_store.episode import Episode
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.writer import McapFile
from episode_store.task_folder import TaskFolder
from experience_cli.commands.learn import digest as digest_of
from experience_cli.main import main
from msgs_bridge.messages.tables import field_from_cloud
from msgs_bridge.node import qos
from robot_bags import robot_bag
from ros_helpers import collect, start_node, wait_until
from sample_helpers import files_of

STORE = get_typestore(Stores.ROS2_JAZZY)
OCCUPANCY, TWIST = 'nav_msgs/msg/OccupancyGrid', 'geometry_msgs/msg/Twist'
N = 200


def drive(i):
    """Return stamp and position of a drive along x."""
    return i / 20, 0.6 + 0.01 * i, 0.6


def record(path, topics, storage=StoragePlugin.MCAP, compression=None, frame='odom'):
    """Record a drive as `ros2 bag record` does; ``topics`` are names by role."""
    writer = Writer(path, version=9, storage_plugin=storage)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    kinds = {'odom': ODOMETRY, 'other': ODOMETRY, 'neighbourhood': OCCUPANCY, 'cmd_vel': TWIST,
             'map': OCCUPANCY, 'goal': 'geometry_msgs/msg/PoseStamped'}
    with writer:
        made = {role: writer.add_connection(name, kinds[role], typestore=STORE)
                for role, name in topics.items()}
        for i in range(N):
            stamp, x, y = drive(i)
            raw = {'odom': raw_odometry(stamp, x, y, frame),
                   'other': raw_odometry(stamp, 0.0, 0.0, frame),
                   'neighbourhood': raw_local_grid(stamp, *GRID.cell_from_world(x, y),
                                              np.zeros((3, 3))),
                   'map': serialize_message(OccupancyGrid()),
                   'goal': serialize_message(PoseStamped()),
                   'cmd_vel': b'\0\1\0\0' + bytes(48)}
            for role, connection in made.items():
                writer.write(connection, nanoseconds(stamp), raw[role])
    return path


def learn(*arguments):
    return main(['learn', *map(str, arguments)])


def mistake(capsys, *arguments):
    """Run the command with a mistake; return the one line it says."""
    assert learn(*arguments) == 2
    [line] = capsys.readouterr().err.splitlines()
    return line


NAMES = {'odom': '/tb3/wheel/odometry', 'cmd_vel': '/tb3/teleop/command',
         'neighbourhood': '/tb3/local/around'}
OPTIONS = ('--odom-topic', NAMES['odom'], '--cmd-vel-topic', NAMES['cmd_vel'],
           '--neighbourhood-topic', NAMES['neighbourhood'])


@pytest.mark.parametrize(('storage', 'compression'), [
    (StoragePlugin.SQLITE3, None), (StoragePlugin.MCAP, None),
    (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    (StoragePlugin.SQLITE3, CompressionMode.FILE), (StoragePlugin.MCAP, CompressionMode.FILE)])
def test_a_drive_of_another_robot_teaches(tmp_path, capsys, storage, compression):
    bag = record(tmp_path / 'rosbag2_2025', NAMES, storage, compression)
    assert learn(bag, *OPTIONS, '--save', tmp_path / 'field.npz') == 0
    line, last = capsys.readouterr().out.splitlines()
    assert 'is learnt: 8 steps. From ' in line
    assert last.startswith('control_field revision 1 sha256 ')
    with np.load(tmp_path / 'field.npz') as saved:
        assert saved['goal'].tolist() == [2, 10]
        assert (saved['known'][1:4, 2:11] == 0).all()  # the neighbourhood was read, too


def test_topics_that_are_called_so_need_no_name(tmp_path, capsys):
    bag = record(tmp_path / 'bag', {'odom': '/r1/odom', 'cmd_vel': '/r1/cmd_vel'})
    assert learn(bag, '--rows', 10, '--cols', 12) == 0
    only = record(tmp_path / 'only', {'odom': '/pose/filtered'})
    assert learn(only, '--rows', 10, '--cols', 12) == 0
    outputs = capsys.readouterr().out.splitlines()
    assert outputs[1] == outputs[3]


def test_the_workspace_can_be_told_or_be_that_of_another_bag(tmp_path, capsys):
    bag = record(tmp_path / 'bag', {'odom': '/odom'}, frame='map')
    assert learn(bag, '--frame', 'map', '--resolution', 0.5, '--origin', -1, -1.5, '--save',
                 tmp_path / 'field.npz') == 0
    with np.load(tmp_path / 'field.npz') as saved:
        assert saved['origin'].tolist() == [-1.0, -1.5]
        assert saved['resolution'] == 0.5
    ours = demonstration_bag(tmp_path / 'bags')
    bag = record(tmp_path / 'like', {'odom': '/odom'})
    assert learn(bag, '--like', ours, '--save', tmp_path / 'field.npz') == 0
    with np.load(tmp_path / 'field.npz') as saved:
        assert saved['resolution'] == GRID.resolution


class TestInto:

    def test_it_becomes_the_next_demonstration_bytes_as_they_are(self, tmp_path, capsys):
        bag = record(tmp_path / 'their_bag', NAMES, StoragePlugin.SQLITE3)
        assert learn(bag, *OPTIONS, '--into', tmp_path / 'bags' / 'shelf') == 0
        assert learn(bag, *OPTIONS, '--into', tmp_path / 'bags' / 'shelf') == 0
        task = TaskFolder(tmp_path / 'bags', 'shelf')
        first, second = task.episodes()
        assert (first.path.name, second.path.name) == ('0001_demo', '0002_demo')
        raw = BagReader(first.bag).messages(NAMES['odom'])
        assert list(raw) == list(open_bag(bag).messages(NAMES['odom']))
        assert len(raw) == N
        assert raw.log_times.tolist() == [nanoseconds(i / 20) for i in range(N)]
        header = Episode.at(first.path).header
        assert (header.topics, header.task) == (NAMES, 'shelf')
        assert len(content_of(first.path).record.cells) == 9
        assert f'{bag} is kept as {first.path}' in capsys.readouterr().out

    def test_a_task_keeps_its_workspace(self, tmp_path, capsys):
        demonstration_bag(tmp_path / 'bags')
        bag = record(tmp_path / 'bag', {'odom': '/odom'})
        task = TaskFolder(tmp_path / 'bags', 'task1')
        line = mistake(capsys, bag, '--into', task.path, '--rows', 7)
        assert '--rows' in line
        assert learn(bag, '--into', task.path) == 0
        assert capsys.readouterr().out.splitlines()[-1].startswith('control_field revision 2')

    @pytest.mark.parametrize('name', [
        'bags/s/0001_demo', 'bags/s/0001_demo/x', 'bags/s/0009_trial', 'whole', 'mcap', 'db3'])
    def test_a_bag_is_no_task(self, tmp_path, capsys, monkeypatch, name):
        monkeypatch.chdir(tmp_path)
        bag = record(tmp_path / 'theirs', {'odom': '/odom'})
        assert learn(bag, '--into', 'bags/s', '--quiet') == 0
        shutil.copytree(bag, 'whole')
        for ending in ('mcap', 'db3'):
            (tmp_path / ending).mkdir()
            (tmp_path / ending / f'drive_0.{ending}').touch()
        files = files_of(tmp_path)
        line = mistake(capsys, bag, '--into', name)
        assert line.startswith(f'experience learn: --into {name}: ')
        assert 'is a bag' in line
        assert 'the folder of a task' in line
        assert files_of(tmp_path) == files

    def test_a_new_task_whose_name_is_nearly_an_old_one_asks(self, tmp_path, capsys):
        bag = record(tmp_path / 'theirs', {'odom': '/odom'})
        assert learn(bag, '--into', tmp_path / 'bags' / 'kitchen') == 0
        line = mistake(capsys, bag, '--into', tmp_path / 'bags' / 'kichen')
        assert f'--into {tmp_path}/bags/kitchen, or --new-task if a new one is meant' in line
        assert not (tmp_path / 'bags' / 'kichen').exists()
        assert learn(bag, '--into', tmp_path / 'bags' / 'kitchen2') == 0
        for name in ('kichen', 'kichen', 'kitchen'):
            assert learn(bag, '--into', tmp_path / 'bags' / name, '--new-task') == 0

    def test_a_task_may_lie_beside_the_files_of_others(self, tmp_path, monkeypatch):
        record(tmp_path / 'theirs', {'odom': '/odom'})
        monkeypatch.chdir(tmp_path / 'theirs')
        assert learn('theirs.mcap', '--into', 'task', '--quiet') == 0

    def test_what_teaches_nothing_leaves_nothing(self, tmp_path, capsys):
        bag = record(tmp_path / 'bag', {'odom': '/odom'}, frame='map')
        line = mistake(capsys, bag, '--into', tmp_path / 'bags' / 'task')
        assert "frame is 'map', must be 'odom'" in line
        assert line.endswith('if that is the right one, learn it with --frame map')
        assert not TaskFolder(tmp_path / 'bags', 'task').episodes()

    def test_unless_all_of_them_can_be_kept_none_is(self, tmp_path, capsys):
        good = record(tmp_path / 'good', {'odom': '/odom'})
        other = record(tmp_path / 'other', {'odom': '/tb3/odometry'})
        far = record(tmp_path / 'far', {'odom': '/odom'}, frame='map')
        task = tmp_path / 'bags' / 'task'
        for bad, why in ((other, 'no topic /odom'), (far, "frame is 'map'"),
                         (tmp_path / 'none', 'there is no bag')):
            line = mistake(capsys, good, bad, '--odom-topic', '/odom', '--into', task)
            assert why in line
            assert str(bad) in line
            assert not TaskFolder(task.parent, task.name).episodes()
        assert learn(good, good, '--odom-topic', '/odom', '--into', task) == 0
        assert capsys.readouterr().out.startswith(f'{good} is kept as {task / "0001_demo"}')

    def test_a_drive_that_ends_where_it_began_is_not_kept(self, tmp_path, capsys):
        bag = loop_bag(tmp_path / 'theirs')
        line = mistake(capsys, bag, '--into', tmp_path / 'bags' / 'task')
        assert 'ends in the cell where it began' in line
        assert not TaskFolder(tmp_path / 'bags', 'task').episodes()
        assert 'ends in the cell where it began' in mistake(capsys, bag, '--odom-topic', '/odom')

    def test_the_learner_starts_from_it(self, tmp_path, capsys, ros_domain, ros_node):
        bag = record(tmp_path / 'bag', NAMES, StoragePlugin.SQLITE3)
        assert learn(bag, *OPTIONS, '--into', tmp_path / 'bags' / 'task') == 0
        digest = capsys.readouterr().out.split()[-1]
        fields = collect(ros_node, PointCloud2, 'control_field', qos.LATCHED)
        with start_node('learner_node.node', tmp_path,
                        {'bags': str(tmp_path / 'bags')}) as process:
            wait_until(lambda: fields, node=ros_node, processes=[process], what='the field')
        assert digest_of(field_from_cloud(fields[-1])) == digest


class TestMistakes:

    def test_a_topic_that_is_not_there(self, tmp_path, capsys):
        bag = record(tmp_path / 'bag', {'odom': '/a/one', 'other': '/b/two', 'cmd_vel': '/go'})
        line = mistake(capsys, bag, '--odom-topic', '/odom')
        assert 'no topic /odom (odom), there are /a/one (Odometry), /b/two (Odometry)' in line
        assert '/go' not in line
        line = mistake(capsys, bag, '--cmd-vel-topic', '/go', '--odom-topic', '/a/one',
                       '--neighbourhood-topic', '/near')
        assert 'none of type nav_msgs/msg/OccupancyGrid (topics: ' in line
        assert '/b/two (nav_msgs/msg/Odometry), /go (geometry_msgs/msg/Twist))' in line

    def test_a_topic_of_another_type(self, tmp_path, capsys):
        bag = record(tmp_path / 'bag', {'odom': '/odom', 'cmd_vel': '/cmd_vel'})
        line = mistake(capsys, bag, '--odom-topic', '/cmd_vel')
        assert '/cmd_vel is geometry_msgs/msg/Twist' in line
        assert 'there are /odom (Odometry)' in line

    def test_none_that_may_be_meant(self, tmp_path, capsys):
        bag = record(tmp_path / 'bag', {'cmd_vel': '/cmd_vel'})
        line = mistake(capsys, bag, '--rows', 9)
        assert 'no topic is odom, there are none of type nav_msgs/msg/Odometry or' in line
        assert '(topics: /cmd_vel (geometry_msgs/msg/Twist))' in line
        assert mistake(capsys, bag) == line

    def test_several_that_may_be_meant(self, tmp_path, capsys):
        bag = record(tmp_path / 'bag', {'odom': '/a/odom', 'other': '/b/odom'})
        for options in ([], ['--rows', 9]):
            line = mistake(capsys, bag, *options)
            assert line.endswith('which topic is odom? Name one of /a/odom (Odometry), /b/odom '
                                 '(Odometry) with --odom-topic')

    @pytest.mark.parametrize(('options', 'words'), [
        (['--rows', 0], ['rows', '1 to']), (['--resolution', -1], ['resolution', 'above 0']),
        (['--rows', 5, '--check'], ['--check']), (['--into', '../../x y'], ['x y', 'letters']),
        (['--like', 'nope'], ['nope'])])
    def test_arguments(self, tmp_path, capsys, options, words):
        bag = record(tmp_path / 'bag', {'odom': '/odom'})
        line = mistake(capsys, bag, *options)
        for word in words:
            assert word in line

    def test_no_bag_at_all(self, tmp_path, capsys):
        assert 'there is no bag' in mistake(capsys, tmp_path / 'none', '--rows', 5)
        (tmp_path / 'empty').mkdir()
        assert 'cannot read' in mistake(capsys, tmp_path / 'empty', '--rows', 5)
        (tmp_path / 'empty' / 'x.mcap').touch()
        assert mistake(capsys, tmp_path / 'empty').endswith('empty/x.mcap: it is empty')

    def test_bags_of_ours_and_of_others_in_one_go(self, tmp_path, capsys):
        bag = record(tmp_path / 'rosbag2_2025', {'odom': '/odom'})
        ours = demonstration_bag(tmp_path / 'bags')
        for paths in ([bag, ours], [ours.parent, bag]):
            line = mistake(capsys, *paths)
            assert f'{bag} is a bag of another recorder' in line
            assert '--into' in line

    def test_a_folder_that_mixes_ours_and_others_is_a_task_of_ours(self, tmp_path, capsys):
        ours = demonstration_bag(tmp_path / 'bags').parent
        assert learn(ours) == 0
        alone = capsys.readouterr().out
        record(ours / 'rosbag2_2025', {'odom': '/odom'})
        assert learn(ours) == 0
        assert capsys.readouterr().out == alone

    def test_a_folder_of_bags_of_others(self, tmp_path, capsys):
        bag = record(tmp_path / 'rosbag2_2025', {'odom': '/odom'})
        line = mistake(capsys, tmp_path)
        assert 'holds no bags, must be a folder of bags like 0001_demo; name those of' in line
        assert line.endswith(f'one by one, such as {bag}')


SHAPES = [(StoragePlugin.SQLITE3, None), (StoragePlugin.MCAP, None),
          (StoragePlugin.MCAP, CompressionMode.STORAGE), *(
              (storage, mode) for storage in StoragePlugin
              for mode in (CompressionMode.MESSAGE, CompressionMode.FILE))]


@pytest.mark.parametrize(('storage', 'compression'), SHAPES)
@pytest.mark.parametrize('name', ['rosbag2_2025', 'my_demo', '2025.11.02'])
def test_without_any_option(tmp_path, capsys, storage, compression, name):
    """By folder or file, also where the file is all that is left of a bag."""
    bag = record(tmp_path / name, {'odom': '/r1/odom', 'cmd_vel': '/cmd_vel'}, storage,
                 compression)
    [file] = [path for path in bag.iterdir() if path.name != 'metadata.yaml']
    paths = [bag, file]
    if compression is not CompressionMode.MESSAGE:
        alone = tmp_path / 'alone'
        alone.mkdir()
        shutil.copyfile(file, alone / file.name)
        paths += [alone, alone / file.name]
    for path in paths:
        assert learn(path) == 0
        line, last = capsys.readouterr().out.splitlines()
        assert line.startswith(f'{path} is learnt: 8 steps. From all ')
        assert 'poses' not in line
        assert 'odom is' not in line
        assert last.startswith('control_field revision 1 sha256 ')


def test_the_only_odometry_is_taken_and_named(tmp_path, capsys):
    bag = record(tmp_path / 'bag', {'odom': '/r1/filtered', 'goal': '/r1/goal'})
    assert learn(bag) == 0
    assert 'odom is /r1/filtered, the only one of its type' in capsys.readouterr().out
    assert learn(bag, '--into', tmp_path / 'bags' / 'task') == 0
    assert 'odom is /r1/filtered, the only one of its type' in capsys.readouterr().out
    assert learn(bag, '--odom-topic', '/r1/filtered') == 0
    assert 'odom is' not in capsys.readouterr().out


def test_a_topic_may_be_named_without_its_slash(tmp_path):
    bag = record(tmp_path / 'bag', {'odom': '/r1/odom', 'map': '/map'})
    assert learn(bag, '--odom-topic', 'r1/odom', '--quiet') == 0


def test_a_topic_without_messages_is_neither_taken_nor_offered(tmp_path, capsys):
    bag = record(tmp_path / 'bag', {'odom': '/robot/odom'})
    path = next(bag.glob('*.mcap'))
    file = McapFile(tmp_path / 'void.mcap', None)
    [(topic, kind)] = open_bag(path).topics.items()
    file.add_channel('/odom', kind, b'', {})
    file.add_channel(topic, kind, b'', {})
    for _, log_time, publish_time, message in open_bag(path).records():
        file.add(topic, message, log_time, publish_time)
    file.finish('void.mcap')
    assert learn('-v', tmp_path / 'void.mcap') == 0
    assert 'in numbers: 9 cells from 200 poses' in capsys.readouterr().out
    line = mistake(capsys, tmp_path / 'void.mcap', '--odom-topic', '/odom')
    assert 'there is no message on /odom (odom), there are /robot/odom (Odometry)' in line


class TestWhatIsMade:
    """Poses from `/tf` and local grid from scans go into the bag that is kept, as messages."""

    @pytest.mark.parametrize('frame', ['odom', 'map'])
    def test_the_bag_that_is_kept_teaches_what_the_external_one_does(
            self, tmp_path, capsys, frame):
        bag = robot_bag(tmp_path / 'tour.bag', ros1=True, odometry=False, to_map=True)
        shas = []
        for options in ((), ('--into', tmp_path / 'bags' / 'kitchen')):
            assert learn(bag, '--frame', frame, *options) == 0
            said = capsys.readouterr().out
            assert f'poses are those of base_footprint in {frame}, from /tf' in said
            assert 'local grid is made from 60 scans on /scan' in said
            shas.append(said.split()[-1])
        bag.unlink()
        assert learn(tmp_path / 'bags' / 'kitchen') == 0
        assert {*shas} == {capsys.readouterr().out.split()[-1]}
        [episode] = TaskFolder(tmp_path / 'bags', 'kitchen').episodes()
        kept = BagReader(episode.bag)
        assert kept.topics == {
            '/odom': 'geometry_msgs/msg/PoseStamped', '/neighbourhood': OCCUPANCY}
        assert content_of(episode.path).record.blocked.any()
        [(_, header), *_] = kept.metadata
        assert 'local grid is made from' in header['imported_notes']

    def test_taken_over_twice_the_bytes_are_the_same(self, tmp_path):
        bag = robot_bag(tmp_path / 'bag', to_map=True)
        for task in ('a', 'b'):
            assert learn(bag, '--frame', 'map', '--into', tmp_path / 'bags' / task, '--quiet') == 0
        first, second = ([(channel.topic, message) for channel, _, _, message in BagReader(
            TaskFolder(tmp_path / 'bags', task).find(1).bag).records()] for task in ('a', 'b'))
        assert first == second

    def test_where_the_laser_sits_can_be_said(self, tmp_path, capsys):
        bag = robot_bag(tmp_path / 'bag', said_mount=False)
        assert learn(bag) == 0
        assert 'no local grid from /scan: nothing says where' in capsys.readouterr().out
        assert learn(bag, '--laser', -0.03, 0.02, 0.17, 3.14159265, 0, 0.4) == 0
        assert 'turned by 0.40 rad, upside down' in capsys.readouterr().out
        assert 'six finite numbers' in mistake(capsys, bag, '--laser', 0, 0, 0, 'nan', 0, 0)

    def test_evaluate_takes_the_same_options(self, tmp_path, capsys):
        bag = robot_bag(tmp_path / 'bag', odometry=False, to_map=True)
        arguments = ['evaluate', '--world', 'task1', '--trials', '0', '--seeds', '1']
        for options, words in (
                (['--frame', 'map'], 'poses are those of base_footprint in map, from /tf'),
                (['--odom-topic', '/tf'], 'poses are those of base_footprint in odom')):
            main([*arguments, '--demo-bag', str(bag), *options])
            assert words in capsys.readouterr().err
        assert main([*arguments, '--goal', '3,3', '--demo-start', '1,1', '--frame', 'map']) == 2
        assert '--frame: says how a bag is to be read' in capsys.readouterr().err


class TestOtherCommands:
    """Bags of others are looked into like those of ours, with the same options."""

    def run(self, capsys, *arguments):
        code = main([str(argument) for argument in arguments])
        return code, *capsys.readouterr()

    def test_show(self, tmp_path, capsys):
        bag = robot_bag(tmp_path / 'tour', to_map=True)
        code, out, err = self.run(capsys, 'show', bag, '--frame', 'map')
        assert code == 0
        assert 'tour/0001 (demo, kept)' in out
        assert f'folder      {bag}, ' in out
        assert 'poses are taken from odom to map by /tf' in out
        [line] = err.splitlines()
        assert line.startswith(f'experience show: {bag} is a bag of another recorder, read as ')
        assert line.endswith('its topics: /odom (120), /scan (60), /tf (144), /tf_static (1)')
        code, out, _ = self.run(capsys, 'show', bag, '--json', '--odom-topic', '/tf')
        assert code == 0
        assert '"goal_cell"' in out

    def test_inspect_draws_beside_the_bag(self, tmp_path, capsys):
        bag = robot_bag(tmp_path / 'tour.bag', ros1=True, odometry=False)
        code, out, err = self.run(capsys, 'inspect', bag)
        assert code == 0
        assert out.splitlines()[-1] == str(tmp_path / 'tour.bag.png')
        assert (tmp_path / 'tour.bag.png').stat().st_size
        assert 'local grid is made from 60 scans' in err

    def test_explain(self, tmp_path, capsys):
        bag = robot_bag(tmp_path / 'tour', odometry=False)
        code, out, err = self.run(capsys, 'explain', bag, '--at', 2)
        assert code == 0
        assert 'robot at (1.400, 1.100) m' in out
        assert 'poses are those of base_footprint in odom' in err

    def test_what_would_change_it_says_how_to_keep_it_first(self, tmp_path, capsys):
        bag = robot_bag(tmp_path / 'tour')
        before = files_of(tmp_path)
        for command in (['trim', bag, '--to', 2], ['forget', bag], ['label', bag, 'failure']):
            code, _, err = self.run(capsys, *command)
            assert code == 2
            assert f'keep it as a demonstration first, `experience learn {bag} --into' in err
        assert files_of(tmp_path) == before

    def test_options_for_others_are_no_options_for_ours(self, capsys):
        for command in ('show', 'explain'):
            more = ['--at', '1'] if command == 'explain' else []
            code, _, err = self.run(capsys, command, 'sample/0001', *more, '--frame', 'map')
            assert code == 2
            assert '--frame: says how a bag of another recorder is to be read' in err


def test_what_is_left_of_a_bag_says_what_is_missing(tmp_path, capsys):
    bag = record(tmp_path / 'bag', {'odom': '/odom'})
    next(bag.glob('*.mcap')).unlink()
    assert 'no .mcap, .db3 or .bag file in it; metadata.yaml names bag.mcap' in mistake(
        capsys, bag)
    (tmp_path / 'tour').mkdir()
    active = tmp_path / 'tour' / 'x.bag.active'
    active.write_bytes(robot_bag(tmp_path / 'x.bag', ros1=True, n=3).read_bytes()[:200])
    for path in (active, active.parent):
        assert '`rosbag reindex x.bag.active` mends it' in mistake(capsys, path)


def test_a_bag_of_ros_1_that_was_not_closed_is_learnt_and_said(tmp_path, capsys):
    data = robot_bag(tmp_path / 'x.bag', ros1=True).read_bytes()
    place = data.index(b'index_pos=') + len(b'index_pos=')
    active = tmp_path / 'x.bag.active'
    active.write_bytes(data[:place] + bytes(8) + data[place + 8:])
    assert main(['learn', str(active)]) == 0
    assert 'x.bag.active was not closed by its recorder: ' in capsys.readouterr().out
