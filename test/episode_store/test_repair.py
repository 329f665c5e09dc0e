"""Bags that were cut: what is readable is kept, what is lost is said."""

import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

from mcap.reader import make_reader
import numpy as np
import pytest
from rosbags.rosbag2 import Reader

from bridge_helpers import demonstration_bag, trial_bag, write_drive
from control_field.words import counted
from episode_store.episode import Episode
from episode_store.repair import repair_bag, repair_task
from episode_store.rosbag2.errors import BagError, mcap_path
from episode_store.rosbag2.mcap_scan import scan
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import TaskFolder
from msgs_bridge.node.environment import child_environment

#: Records until it is killed; says on every line how many messages are in and which is the last.
RECORDER = """
import sys, time
from bridge_helpers import raw_odometry, ODOMETRY
from episode_store.making import start_bag
from episode_store.task_folder import TaskFolder
bag = start_bag(TaskFolder(sys.argv[1], 'task1'), 'demo', {'version': '1'})
for i in range(1_000_000):
    bag.write('/odom', ODOMETRY, raw_odometry(i * 0.02, 0.0, 0.0), i * 20_000_000)
    print(time.monotonic(), i, flush=True)
    time.sleep(0.001)
"""


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    return demonstration_bag(tmp_path_factory.mktemp('bags'), n=60)


def copy_cut(whole: Path, root: Path, cut: int) -> Path:
    """Copy a bag as a kill would have left it: cut off, without its metadata.yaml."""
    folder = root / 'task1' / whole.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    mcap_path(folder).write_bytes(mcap_path(whole).read_bytes()[:cut])
    return folder


def messages(folder: Path):
    return [(channel.topic, time, raw)
            for channel, time, _, raw in BagReader(mcap_path(folder)).records()]


def check_mended(folder: Path, whole: Path):
    """Mend a bag; see that it is a beginning of the whole one, and that others read it."""
    before = messages(folder)
    report = repair_bag(folder)
    kept = messages(folder)
    assert kept == before == messages(whole)[:len(kept)]
    assert report.n_messages == len(kept)
    assert Episode.at(folder).is_closed
    again = repair_bag(folder)
    assert not again.changed
    assert again.n_messages == len(kept)
    with Reader(folder) as reader:
        assert reader.message_count == sum(1 for _ in reader.messages()) == len(kept)
    if kept:
        assert BagReader(mcap_path(folder)).metadata[0] == BagReader(mcap_path(whole)).metadata[0]
    return report


def test_a_whole_bag_is_left_alone(whole):
    before = mcap_path(whole).read_bytes()
    report = repair_bag(whole)
    assert not report.changed
    assert str(report) == f'{whole}: whole, {report.n_messages} messages'
    assert mcap_path(whole).read_bytes() == before


@pytest.mark.parametrize('broken', [None, b'', b': [', b'\xff', b'rosbag2_bagfile_information: 1'])
def test_missing_metadata_is_written_anew_as_it_was(whole, tmp_path, broken):
    folder = copy_cut(whole, tmp_path, 10**9)
    assert not Episode.at(folder).is_closed
    if broken is not None:
        (folder / 'metadata.yaml').write_bytes(broken)
    report = check_mended(folder, whole)
    assert 'metadata.yaml was missing or broken, written anew; no message lost' in str(report)
    assert (folder / 'metadata.yaml').read_text() == (whole / 'metadata.yaml').read_text()


@pytest.mark.parametrize('part', np.linspace(0.0, 1.0, 25).round(3).tolist())
def test_cut_anywhere(whole, tmp_path, part):
    size = mcap_path(whole).stat().st_size
    folder = copy_cut(whole, tmp_path, int(part * (size - 1)))
    report = check_mended(folder, whole)
    assert report.changed
    if report.kept:
        assert report.kept.read_bytes() == mcap_path(whole).read_bytes()[:int(part * (size - 1))]
        assert f'{counted(report.n_lost_bytes, "byte")} could not be read, the file' in str(report)


def test_bytes_that_changed_on_the_disk_are_found(whole, tmp_path):
    folder = copy_cut(whole, tmp_path, 10**9)
    data = bytearray(mcap_path(folder).read_bytes())
    data[len(data) // 2] ^= 1
    mcap_path(folder).write_bytes(data)
    report = repair_bag(folder)
    assert 'does not match its checksum' in str(report)
    assert 0 < report.n_messages < len(messages(whole))
    assert report.kept.read_bytes() == data
    with Reader(folder) as reader:
        assert len(list(reader.messages())) == reader.message_count == report.n_messages
    assert not repair_bag(folder).changed


@pytest.mark.parametrize(('good', 'bad'), [
    (b'nsec: 854775807', b'nsxc: 854775807'), (b'reliability: ', b'reliab\0lity: '),
    (b'RIHS01_', b'RIHS\n1_'), (b'float64', b'flo\xfft64'), (b'/odom', b'\0odom'),
    (b'nav_msgs/msg/', b'nav_msgs: msg')])
def test_descriptions_that_were_hit_do_not_spoil_the_rest(whole, tmp_path, good, bad):
    folder = copy_cut(whole, tmp_path, 10**9)
    data = mcap_path(folder).read_bytes()
    mcap_path(folder).write_bytes(data.replace(good, bad))
    report = repair_bag(folder)
    assert report.n_messages > 0
    with Reader(folder) as reader:
        assert len(list(reader.messages())) == reader.message_count == report.n_messages


def test_where_the_index_names_a_topic_that_is_gone_nothing_is_read(whole, tmp_path):
    folder = copy_cut(whole, tmp_path, 10**9)
    data = bytearray(mcap_path(folder).read_bytes())
    with mcap_path(folder).open('rb') as file:
        first = make_reader(file).get_summary().chunk_indexes[0]
    start, end = first.chunk_start_offset + 49, first.chunk_start_offset + first.chunk_length
    data[start:end] = bytes(end - start)
    mcap_path(folder).write_bytes(data)
    for topic in ('/odom', '/trial', '/cmd_vel'):
        assert len(BagReader(mcap_path(folder)).messages(topic)) < 200
    assert repair_bag(folder).damage


def test_of_a_recording_that_was_cut_at_once_nothing_could_be_saved(whole, tmp_path):
    folder = copy_cut(whole, tmp_path, 100)
    assert 'no message could be saved' in str(repair_bag(folder))
    assert (folder / '0001_demo_0.mcap.cut').stat().st_size == 100


def cut_at(whole, tmp_path, distance):
    size = mcap_path(whole).stat().st_size
    report = check_mended(copy_cut(whole, tmp_path, size - distance), whole)
    assert report.damage
    lost = len(messages(whole)) - report.n_messages
    assert report.complete == ('no message lost' in str(report))
    assert lost == 0 or not report.complete


@pytest.mark.parametrize(
    'distance', [1, 2, 7, 8, 9, 20, 29, 36, 37, 38, 100, *range(400, 4097, 462)])
def test_cut_in_the_last_bytes(whole, tmp_path, distance):
    cut_at(whole, tmp_path, distance)


def test_every_cut_of_the_last_4096_bytes_opens_and_is_said(whole):
    data, n_sent = mcap_path(whole).read_bytes(), len(messages(whole))
    for cut in range(len(data) - 4096, len(data)):
        found = scan(memoryview(data)[:cut])
        n_read = sum(map(len, found.starts.values()))
        assert found.damage
        assert n_read == n_sent or (not found.complete and n_read < n_sent)


@pytest.mark.slow
@pytest.mark.parametrize('first', range(1, 33, 16))
def test_cut_all_over_the_last_4096_bytes(whole, tmp_path, first):
    for distance in range(first, 4097, 32):
        cut_at(whole, tmp_path, distance)


def test_a_cut_among_the_messages_says_the_last_time_and_keeps_the_rest(whole, tmp_path):
    starts = BagReader(mcap_path(whole)).messages('/odom').starts
    report = check_mended(copy_cut(whole, tmp_path, int(starts[30]) + 100), whole)
    assert not report.complete
    assert report.last_time == 1_500_000_000
    assert 'the last at 1.500 s' in str(report)
    assert report.kept is not None


def test_bytes_that_went_bad_are_said(whole, tmp_path):
    folder = copy_cut(whole, tmp_path, 10**9)
    path = mcap_path(folder)
    starts = BagReader(path).messages('/odom').starts
    data = bytearray(path.read_bytes()[:-1])
    data[int(starts[5]) + 50] ^= 0xFF
    path.write_bytes(data)
    report = repair_bag(folder)
    assert 'does not match its checksum' in str(report)
    assert not report.complete
    assert report.kept.read_bytes() == bytes(data)
    assert 0 < report.n_messages < len(messages(whole))
    assert not repair_bag(folder).changed


def test_an_empty_folder_becomes_an_empty_bag(tmp_path):
    episode = TaskFolder(tmp_path, 'task1').new_episode('trial')
    report = repair_bag(episode.path)
    assert (report.changed, report.n_messages) == (True, 0)
    with Reader(episode.path) as reader:
        assert reader.message_count == 0
    assert not repair_bag(episode.path).changed


def test_a_task_is_mended_bag_by_bag(whole, tmp_path):
    copy_cut(whole, tmp_path, 20_000)
    trial_bag(tmp_path, lambda bag: write_drive(bag, 3))
    task = TaskFolder(tmp_path, 'task1')
    task.new_episode('trial')
    assert [report.folder.name for report in repair_task(task)] == ['0001_demo', '0003_trial']
    assert repair_task(task) == []


def test_what_is_no_bag_of_ours_is_not_touched(tmp_path):
    (tmp_path / 'other_0.db3').touch()
    with pytest.raises(BagError, match=r'is no bag of ours: it holds other_0\.db3'):
        repair_bag(tmp_path)
    with pytest.raises(BagError, match='there is no bag'):
        repair_bag(tmp_path / 'none')
    episode = TaskFolder(tmp_path, 'task1').new_episode('demo')
    episode.bag.write_text('a poem')
    with pytest.raises(BagError, match='it is no MCAP file'):
        repair_bag(episode.path)
    assert episode.bag.read_text() == 'a poem'


def kill_while_recording(root: Path, wait: float) -> tuple[float, int]:
    """Record, kill -9, mend; return how much was lost on the wall clock [s], and the messages."""
    environment = child_environment()
    environment['PYTHONPATH'] += f':{Path(__file__).parent.parent}'
    with subprocess.Popen([sys.executable, '-c', RECORDER, str(root)], env=environment,
                          stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        deadline = time.monotonic() + wait
        line = process.stdout.readline()
        while float(line.split()[0]) < deadline:
            line = process.stdout.readline()
        process.send_signal(signal.SIGKILL)
        said = [line, *process.stdout.readlines()]
    times = {int(i): float(at) for at, i in (text.split() for text in said
                                             if text.endswith('\n'))}
    report = repair_bag(TaskFolder(root, 'task1').episodes()[-1].path)
    read = BagReader(mcap_path(report.folder)).messages('/odom')
    assert (np.diff(read.log_times) == 20_000_000).all()
    last = len(read) - 1
    # Stamps of messages before the line that was read last are not known, and not needed.
    return max(times) * 0.02 - last * 0.02, len(read)


@pytest.mark.parametrize('wait', [0.05, 0.4, 1.1])
def test_a_kill_loses_a_second_at_most(tmp_path, wait):
    lost, n_messages = kill_while_recording(tmp_path, wait)
    assert lost <= 1.0
    assert n_messages > 0 or wait < 0.1


@pytest.mark.slow
def test_many_kills_at_random_moments(tmp_path):
    """KILLS=200 in the environment makes it two hundred."""
    waits = np.random.default_rng(1).uniform(0.0, 1.0, int(os.environ.get('KILLS', '15')))
    lost = [kill_while_recording(tmp_path, wait)[0] for wait in waits]
    print(f'{len(lost)} kills lost {np.median(lost):.2f} s each, {max(lost):.2f} s at most')
    assert max(lost) <= 1.0
