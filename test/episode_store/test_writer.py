"""Bags as they are written: read back by two others, and what happens when writing fails."""

import os
from pathlib import Path
import subprocess
import tempfile

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_typestore, Stores

from bridge_helpers import demonstration_bag, ODOMETRY, raw_odometry, run_python, write_drive
from episode_store.making import start_bag
from episode_store.rosbag2.errors import BagError, mcap_path
from episode_store.rosbag2.metadata import OfferedQos
from episode_store.rosbag2.reader import BagReader
from episode_store.rosbag2.writer import BagWriter
from episode_store.task_folder import TaskFolder

STORE = get_typestore(Stores.ROS2_JAZZY)
#: Records until the file may grow no more; says how many messages were taken and what was said.
FULL_DISK = """
import resource, sys
from bridge_helpers import write_drive
from episode_store.making import start_bag
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder
bag = start_bag(TaskFolder(sys.argv[1], 'task1'), 'demo', {'version': '1'})
if len(sys.argv) > 2:
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
said = []
for attempt in (lambda: write_drive(bag, 5000), bag.flush, lambda: write_drive(bag, 1), bag.close):
    try:
        attempt()
        said.append('')
    except BagError as error:
        said.append(str(error))
print(bag.n_messages, *said, sep='|')
"""


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return demonstration_bag(tmp_path_factory.mktemp('bags'))


def test_rosbags_reads_what_was_written(bag):
    with AnyReader([bag]) as reader:
        counts = {item.topic: item.msgcount for item in reader.connections}
        assert counts == {'/trial': 2, '/neighbourhood': 200, '/odom': 200, '/cmd_vel': 200}
        read = dict.fromkeys(counts, 0)
        for item, time, raw in reader.messages():
            msg = reader.deserialize(raw, item.msgtype)
            if item.topic == '/odom':
                stamp = read['/odom'] / 20.0
                assert msg.pose.pose.position.x == 0.5 + 0.2 * stamp
                assert time == round(stamp * 1e9)
            read[item.topic] += 1
        assert read == counts
        assert (reader.start_time, reader.end_time) == (0, 10 * 10**9 + 1)


def test_metadata_agrees_with_the_file(bag):
    """rosbags reads nothing, silently, where profiles differ; hashes are those of the types."""
    with Reader(bag) as folder, Reader(mcap_path(bag)) as file:
        assert folder.message_count == file.message_count == 602
        assert {(item.topic, item.msgtype, item.msgcount, str(item.ext))
                for item in folder.connections} == {
            (item.topic, item.msgtype, item.msgcount, str(item.ext)) for item in file.connections}
        for item in folder.connections:
            assert item.digest == STORE.hash_rihs01(item.msgtype)
        assert sum(1 for _ in folder.messages()) == 602


def test_mcap_ros2_support_reads_what_was_written(bag):
    with mcap_path(bag).open('rb') as file:
        read = list(make_reader(file, decoder_factories=[DecoderFactory()])
                    .iter_decoded_messages())
    assert len(read) == 602
    driven = [msg for _, channel, _, msg in read if channel.topic == '/odom']
    assert driven[-1].pose.pose.position.x == 0.5 + 0.2 * 199 / 20.0
    assert driven[-1].header.frame_id == 'odom'


def test_bytes_are_kept_as_they_arrived(tmp_path):
    raw = [os.urandom(n) for n in (0, 1, 40, 100_000)]
    with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', {}) as bag:
        for i, message in enumerate(raw):
            bag.write('/odom', ODOMETRY, message, i, 10 + i)
    reader = BagReader(bag.path)
    assert list(reader.messages('/odom')) == raw
    assert [record[1:3] for record in reader.records()] == [(i, 10 + i) for i in range(4)]


def test_the_header_stands_before_the_first_message(tmp_path):
    bag = start_bag(TaskFolder(tmp_path, 'task1'), 'demo', {'version': '1', 'task': 'wörld'})
    reader = BagReader(bag.path)
    assert reader.metadata == [('experience_controller', {'version': '1', 'task': 'wörld'})]
    assert not reader.complete
    bag.close()


def test_what_was_flushed_is_there_and_little_else_waits(tmp_path):
    bag = start_bag(TaskFolder(tmp_path, 'task1'), 'demo', {})
    write_drive(bag, 3)
    bag.flush()
    assert len(BagReader(bag.path).messages('/odom')) == 3
    write_drive(bag, 100, rate=10.0)
    # By the stamps, no more than half a second of messages may wait; here that is 5 of them.
    assert len(BagReader(bag.path).messages('/odom')) >= 98
    bag.close()
    bag.close()
    assert len(BagReader(bag.path).messages('/odom')) == 103


def test_topics_may_be_offered_in_another_way(tmp_path):
    with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', {}) as bag:
        bag.add_topic('/odom', ODOMETRY, OfferedQos('keep_last', 3, 'best_effort', 'volatile'))
        bag.write('/odom', ODOMETRY, raw_odometry(0.0, 0.0, 0.0), 0)
    with Reader(bag.folder) as reader:
        (item,) = reader.connections
        assert item.ext.offered_qos_profiles[0].depth == 3
        assert sum(1 for _ in reader.messages()) == 1


@pytest.mark.parametrize(('topic', 'type_name', 'sentence'), [
    ('/odom', 'nav_msgs/msg/Path', '/odom is nav_msgs/msg/Path, but was nav_msgs/msg/Odometry'),
    ('/o dom', ODOMETRY, "'/o dom' is no topic name"), ('', ODOMETRY, 'no topic name'),
    ('/new', 'none_msgs/msg/None', 'the definition of none_msgs/msg/None is not installed')])
def test_a_mistake_is_refused_and_the_bag_goes_on(topic, type_name, sentence, tmp_path):
    with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', {}) as bag:
        bag.write('/odom', ODOMETRY, raw_odometry(0.0, 0.0, 0.0), 0)
        with pytest.raises(BagError, match=sentence):
            bag.write(topic, type_name, b'', 0)
        bag.write('/odom', ODOMETRY, raw_odometry(0.1, 0.0, 0.0), 1)
    with Reader(bag.folder) as reader:
        assert reader.message_count == 2


def test_a_closed_bag_takes_nothing(tmp_path):
    with start_bag(TaskFolder(tmp_path, 'task1'), 'demo', {}) as bag:
        pass
    for attempt in (bag.flush, lambda: bag.write('/odom', ODOMETRY, b'', 0)):
        with pytest.raises(BagError, match='is closed'):
            attempt()
    with pytest.raises(BagError, match=r'cannot record into .*: file exists'):
        BagWriter(bag.folder, {})


def check_kept(ran, root, reason):
    """See that one line was said, and that what was taken before is readable."""
    assert ran.stderr == ''
    taken, first, second, third, closing = ran.stdout.strip().split('|')
    path = mcap_path(root / 'task1' / '0001_demo')
    assert first == f'cannot record into {path}: {reason}'
    assert (second, third, closing) == (first, first, '')
    reader = BagReader(path)
    assert reader.n_lost_bytes == 0
    read = sum(len(reader.messages(topic)) for topic in reader.topics)
    # What waited for its chunk to be full is lost: half a second at most.
    assert int(taken) - 60 <= read <= int(taken)
    assert read > 100


def test_a_file_that_may_not_grow(tmp_path):
    check_kept(run_python(FULL_DISK, str(tmp_path), '300000'), tmp_path, 'file too large')


@pytest.fixture
def small_disk():
    # Not below tmp_path: if this run is killed, a disk left there stops every later one, which
    # wants to clear old folders away.
    disk = Path(tempfile.mkdtemp(prefix='small_disk_'))
    mounted = subprocess.run(['mount', '-t', 'tmpfs', '-o', 'size=400k', 'tmpfs', str(disk)],
                             capture_output=True, check=False)
    if mounted.returncode:
        disk.rmdir()
        pytest.skip('mounting a small disk needs root')
    yield disk
    subprocess.run(['umount', str(disk)], check=True)
    disk.rmdir()


def test_a_full_disk(small_disk):
    check_kept(run_python(FULL_DISK, str(small_disk)), small_disk, 'no space left on device')


def test_a_disk_that_is_full_from_the_start(small_disk):
    (small_disk / 'rest').write_bytes(bytes(390_000))
    (small_disk / 'task1').mkdir()
    task = TaskFolder(small_disk, 'task1')
    (task.path / '.lock').touch()
    while True:
        try:
            with (small_disk / 'rest').open('ab') as file:
                file.write(bytes(512))
        except OSError:
            break
    with pytest.raises(BagError, match='no space left on device'):
        start_bag(task, 'demo', {})
    assert task.episodes() == []


def test_a_read_only_disk(small_disk):
    task = TaskFolder(small_disk, 'task1')
    bag = start_bag(task, 'demo', {})
    bag.close()
    subprocess.run(['mount', '-o', 'remount,ro', str(small_disk)], check=True)
    with pytest.raises(BagError, match='read-only file system'):
        start_bag(task, 'demo', {})
    assert len(task.episodes()) == 1


def test_no_permission(tmp_path):
    if os.getuid() != 0:
        pytest.skip('only root can become someone who has no permission')
    tmp_path.chmod(0o755)
    for folder in tmp_path.parents:
        if folder.stat().st_uid == 0 and folder.name.startswith('pytest'):
            folder.chmod(0o755)
    task = TaskFolder(tmp_path, 'task1')
    task.new_episode('demo')
    code = """
import os, sys
from episode_store.task_folder import *
from episode_store.rosbag2.writer import BagWriter
os.setuid(65534)
task = TaskFolder(sys.argv[1], 'task1')
for attempt in (lambda: task.new_episode('demo'), lambda: BagWriter(task.find(1).path, {})):
    try:
        attempt()
    except BagError as error:
        print(error)
"""
    ran = run_python(code, str(tmp_path))
    assert ran.stderr == ''
    assert [line.partition(': ')[2] for line in ran.stdout.splitlines()] == [
        'permission denied'] * 2
