"""Bags of other recorders without any option, and in other commands than `learn`."""

from itertools import cycle
import json
import shutil

import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from bridge_helpers import content_of
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.writer import McapFile
from episode_store.task_folder import TaskFolder
from experience_cli.main import main
from external_bags import drive_bag, OCCUPANCY
from robot_bags import robot_bag
from sample_helpers import files_of


def learn(*arguments):
    return main(['learn', *map(str, arguments)])


@pytest.fixture
def run(capsys):
    """Run a command that must do what it says; return its output, and what it says beside it."""
    def call(*words):
        assert main([str(word) for word in words]) == 0
        return capsys.readouterr()

    return call


SHAPES = [(StoragePlugin.SQLITE3, None), (StoragePlugin.MCAP, None),
          (StoragePlugin.MCAP, CompressionMode.STORAGE), *(
              (storage, mode) for storage in StoragePlugin
              for mode in (CompressionMode.MESSAGE, CompressionMode.FILE))]
FOLDERS = ['rosbag2_2025', 'my_demo', '2025.11.02']


@pytest.mark.parametrize(('storage', 'compression', 'name'), [
    *((*shape, name) for shape, name in zip(SHAPES, cycle(FOLDERS), strict=False)),
    *((*SHAPES[0], name) for name in FOLDERS[1:])])
def test_without_any_option(tmp_path, capsys, storage, compression, name):
    """By folder or file, also where the file is all that is left of a bag."""
    bag = drive_bag(tmp_path / name, {'odom': '/r1/odom', 'cmd_vel': '/cmd_vel'}, storage,
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
        assert line.startswith(f'{path} is learnt: 8 steps. The workspace fits the drive: ')
        assert 'poses' not in line
        assert 'odom is' not in line
        assert last.startswith('control_field revision 1 sha256 ')


def test_the_only_odometry_is_taken_and_named(tmp_path, capsys):
    bag = drive_bag(tmp_path / 'bag', {'odom': '/r1/filtered', 'goal': '/r1/goal'})
    assert learn(bag) == 0
    assert 'odom is /r1/filtered, the only one of its type' in capsys.readouterr().out
    assert learn(bag, '--into', tmp_path / 'bags' / 'task') == 0
    assert 'odom is /r1/filtered, the only one of its type' in capsys.readouterr().out
    assert learn(bag, '--odom-topic', '/r1/filtered') == 0
    assert 'odom is' not in capsys.readouterr().out


def test_a_topic_may_be_named_without_its_slash(tmp_path):
    bag = drive_bag(tmp_path / 'bag', {'odom': '/r1/odom', 'map': '/map'})
    assert learn(bag, '--odom-topic', 'r1/odom', '--quiet') == 0


def test_a_topic_without_messages_is_neither_taken_nor_offered(tmp_path, capsys, mistake):
    bag = drive_bag(tmp_path / 'bag', {'odom': '/robot/odom'})
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
    line = mistake('learn', tmp_path / 'void.mcap', '--odom-topic', '/odom')
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

    def test_where_the_laser_sits_can_be_said(self, tmp_path, capsys, mistake):
        bag = robot_bag(tmp_path / 'bag', said_mount=False)
        assert learn(bag) == 0
        assert 'no local grid from /scan: nothing says where' in capsys.readouterr().out
        assert learn(bag, '--laser', -0.03, 0.02, 0.17, 3.14159265, 0, 0.4) == 0
        assert 'turned by 0.40 rad, upside down' in capsys.readouterr().out
        assert 'six finite numbers' in mistake('learn', bag, '--laser', 0, 0, 0, 'nan', 0, 0)

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

    def test_show(self, tmp_path, run):
        bag = robot_bag(tmp_path / 'tour', to_map=True)
        out, err = run('show', bag, '--frame', 'map', '--out', tmp_path / 'x' / 'drive.png')
        lines = out.splitlines()
        assert lines[0].startswith(f"{bag}: a drive of 6.0 s and 2.4 m in 'odom', x from 0.60 to ")
        assert lines[1] == (f'`experience learn {bag}` learns it: 10 steps from (1.50, 0.50) m to '
                            f'(4.00, 0.50) m')
        assert 'poses are taken from odom to map by /tf' in out
        assert 'local grids can be made from 60 scans on /scan' in out
        assert err == ''
        assert (tmp_path / 'x' / 'drive.png').read_bytes().startswith(b'\x89PNG')
        about = json.loads(run('show', bag, '--json', '--odom-topic', '/tf').out)
        assert about['demonstration']['goal_cell'] == [12, 20]
        assert about['would_be_learnt']
        assert about['why'] == 'it was named'
        assert [each['topic'] for each in about['sources']] == ['/odom', '/tf']
        assert about['topics'][1] == {
            'topic': '/scan', 'type': 'sensor_msgs/msg/LaserScan', 'messages': 60}

    def test_inspect_draws_beside_the_bag(self, tmp_path, run):
        bag = robot_bag(tmp_path / 'tour.bag', ros1=True, odometry=False)
        out, err = run('inspect', bag)
        assert out.splitlines()[-1] == str(tmp_path / 'tour.bag.png')
        assert (tmp_path / 'tour.bag.png').stat().st_size
        assert 'local grid is made from 60 scans' in err

    def test_explain(self, tmp_path, run):
        bag = robot_bag(tmp_path / 'tour', odometry=False)
        out, err = run('explain', bag, '--at', 2)
        assert 'robot at (1.400, 1.100) m' in out
        assert 'poses are those of base_footprint in odom' in err

    def test_what_would_change_it_says_how_to_keep_it_first(self, tmp_path, mistake):
        bag = robot_bag(tmp_path / 'tour')
        before = files_of(tmp_path)
        for command in (['trim', bag, '--to', 2], ['forget', bag], ['label', bag, 'failure']):
            assert f'keep it as a demonstration first, `experience learn {bag} --into' in (
                mistake(*command))
        assert files_of(tmp_path) == before

    def test_options_for_others_are_no_options_for_ours(self, mistake):
        for command in ('show', 'explain'):
            more = ['--at', '1'] if command == 'explain' else []
            assert '--frame: says how a bag of another recorder is to be read' in mistake(
                command, 'sample/0001', *more, '--frame', 'map')


def test_what_is_left_of_a_bag_says_what_is_missing(tmp_path, mistake):
    bag = drive_bag(tmp_path / 'bag', {'odom': '/odom'})
    next(bag.glob('*.mcap')).unlink()
    line = mistake('learn', bag)
    assert 'no .mcap, .db3 or .bag file in it; metadata.yaml names bag.mcap' in line
    (tmp_path / 'tour').mkdir()
    active = tmp_path / 'tour' / 'x.bag.active'
    active.write_bytes(robot_bag(tmp_path / 'x.bag', ros1=True, n=3).read_bytes()[:200])
    for path in (active, active.parent):
        assert '`rosbag reindex x.bag.active` mends it' in mistake('learn', path)


def test_a_bag_of_ros_1_that_was_not_closed_is_learnt_and_said(tmp_path, capsys):
    data = robot_bag(tmp_path / 'x.bag', ros1=True).read_bytes()
    place = data.index(b'index_pos=') + len(b'index_pos=')
    active = tmp_path / 'x.bag.active'
    active.write_bytes(data[:place] + bytes(8) + data[place + 8:])
    assert main(['learn', str(active)]) == 0
    assert 'x.bag.active was not closed by its recorder: ' in capsys.readouterr().out
