"""Links, pipes, devices and endless files in a bag's folder: nothing hangs, nothing gets out."""

from contextlib import contextmanager
import os
from pathlib import Path
import resource
import shutil
import signal

from mcap.writer import CompressionType, Writer
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionMode
from rosbags.rosbag2 import reader as rosbags_reader
from rosbags.rosbag2 import StoragePlugin

from episode_store.repair import repair_task
from episode_store.rosbag2.any_reader import open_bag
from episode_store.rosbag2.errors import BagError, mcap_path
from episode_store.rosbag2.unpacking import _lz4, MOST_OF_A_BAG, unpack
from episode_store.task_folder import TaskFolder
from experience_cli.main import main
from external_bags import external_bag, ros1_bag
from sample_helpers import sample_copy

SECONDS = 30
MEMORY = 2 * 2**30
BOMB = '\n'.join(['a0: &a0 [x, x]', *(
    f'a{i}: &a{i} [*a{i - 1}, *a{i - 1}]' for i in range(1, 40))])


@contextmanager
def bounded():
    """Let what takes too long, or too much memory, fail instead of taking the machine along."""
    def ring(number, frame):
        raise AssertionError(f'it hangs for {SECONDS} s')

    used = int(Path('/proc/self/statm').read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    handler = signal.signal(signal.SIGALRM, ring)
    signal.alarm(SECONDS)
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
        signal.alarm(0)
        signal.signal(signal.SIGALRM, handler)


def said(capsys, *arguments):
    """Run a command; return its exit code, and what it said."""
    capsys.readouterr()
    with bounded():
        code = main(list(arguments))
    return code, capsys.readouterr()


@pytest.fixture
def task(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return sample_copy(tmp_path)


@pytest.fixture
def victim(tmp_path):
    path = tmp_path / 'victim'
    path.write_text('mine')
    return path


def sparse(path):
    with path.open('wb') as file:
        file.truncate(200 * 2**20)


ODD = {
    'pipe': os.mkfifo, 'endless': lambda path: path.symlink_to('/dev/zero'),
    'folder': lambda path: path.mkdir(), 'huge': sparse,
    'out': lambda path: path.symlink_to(path.parent.parent.parent.parent / 'victim')}
COMMANDS = [('show', 'sample/0002'), ('label', 'sample/0002', 'failure'),
            ('repair', 'bags/sample/0002_trial'), ('learn', 'bags/sample')]


@pytest.mark.parametrize('kind', ODD)
def test_odd_metadata_harms_nobody(task, victim, capsys, kind):
    path = task.find(2).path / 'metadata.yaml'
    path.unlink()
    ODD[kind](path)
    code, output = said(capsys, 'list')
    assert code == 0
    assert [line.split()[2] for line in output.out.splitlines()[1:4]] == [
        'kept', 'unreadable', 'kept']
    assert 'sample/0002_trial/metadata.yaml: it ' in output.out
    for command in COMMANDS:
        code, output = said(capsys, *command)
        assert code == 2, command
        assert len(output.err.splitlines()) == 1
        assert 'metadata.yaml' in output.err
    assert victim.read_text() == 'mine'


@pytest.mark.parametrize('kind', ['pipe', 'endless', 'folder', 'out'])
def test_an_odd_recording_harms_nobody(task, victim, capsys, kind):
    episode = task.find(2)
    shutil.copy(episode.bag, victim)
    episode.bag.unlink()
    ODD[kind](episode.bag)
    code, output = said(capsys, 'list')
    assert code == 0
    assert output.out.splitlines()[2].split()[2] == 'unreadable'
    for command in COMMANDS:
        code, output = said(capsys, *command)
        assert code == 2, command
        assert episode.bag.name in output.err


@pytest.mark.parametrize('name', ['metadata.yaml.tmp', '{bag}.tmp', '{stem}.mcap.tmp',
                                  '.metadata.yaml.tmp'])
def test_links_that_wait_for_a_draft_are_not_followed(task, victim, capsys, name):
    episode = task.find(2)
    name = name.format(bag=episode.bag.name, stem=episode.bag.stem)
    (episode.path / name).symlink_to(victim)
    for command in [('label', 'sample/0002', 'failure'), ('label', 'sample/0002', 'none')]:
        assert said(capsys, *command)[0] == 0
    with episode.bag.open('r+b') as file:  # what a kill leaves, mended where a learner starts
        file.truncate(episode.bag.stat().st_size // 2)
    with bounded():
        assert len(repair_task(task)) == 1
    assert victim.read_text() == 'mine'


def begin(task):
    """Do what a learner does that records."""
    task.hold()
    task.new_episode('demo')


@pytest.mark.parametrize('name', ['.in_use', '.lock', '.forgotten'])
@pytest.mark.parametrize('exists', [True, False])
def test_what_is_ours_in_a_task_is_no_link_out(task, tmp_path, capsys, name, exists):
    outside = tmp_path / 'outside'
    if exists:
        outside.mkdir() if name == '.forgotten' else outside.write_text('mine')
    (task.path / name).symlink_to(outside)
    code, output = said(capsys, 'forget', 'sample/0003')
    assert code == 2
    assert f'bags/sample/{name}: it is a link' in output.err
    assert 'link' in output.err
    with pytest.raises(BagError, match='link'):
        begin(task)
    assert [episode.number for episode in task.episodes()] == [1, 2, 3]
    if not exists:
        assert not outside.exists()
    else:
        assert list(outside.iterdir()) == [] if outside.is_dir() else (
            outside.read_text() == 'mine')


def link_for_forgotten(path):
    (path / '.forgotten').symlink_to(path.parent.parent)


def same_number_twice(path):
    (path / '0002_demo').mkdir()


@pytest.mark.parametrize('spoil', [link_for_forgotten, same_number_twice])
def test_a_task_that_cannot_be_read_does_not_hide_the_others(task, capsys, spoil):
    bags = task.root
    for name in ('a_task', 'b_task', 'z_task'):
        shutil.copytree(task.path, bags / name)
    spoil(bags / 'b_task')
    for _ in range(3):
        TaskFolder(bags, 'z_task').forget(len(TaskFolder(bags, 'z_task').episodes()))
    code, output = said(capsys, 'list')
    assert code == 0
    rows = [line.split()[0] for line in output.out.splitlines()[1:] if ': ' not in line]
    assert {f'{name}/000{number}' for name in ('a_task', 'sample', 'z_task')
            for number in (1, 2, 3)} <= set(rows)
    assert len(output.err.splitlines()) == 1
    assert output.err.startswith('not in the list: ')
    assert 'bags/b_task/' in output.err


@pytest.mark.parametrize('name', ['.in_use', '.lock'])
def test_a_pipe_instead_of_a_lock_is_said(task, name):
    os.mkfifo(task.path / name)
    with bounded(), pytest.raises(BagError, match='named pipe'):
        begin(task)


def test_notes_that_stand_for_more_than_memory_holds_are_no_notes(task, capsys):
    path = task.find(2).path / 'metadata.yaml'
    path.write_text(path.read_text() + BOMB)
    code, output = said(capsys, 'repair', 'bags/sample/0002_trial')
    assert code == 0
    assert 'written anew' in output.out
    assert said(capsys, 'list')[0] == 0


@pytest.fixture
def external(tmp_path):
    return external_bag(tmp_path / 'drive', StoragePlugin.SQLITE3)


@pytest.mark.parametrize('kind', ['pipe', 'endless', 'folder', 'out'])
def test_files_that_metadata_names_are_held_in(external, tmp_path, kind):
    [path] = external.glob('*.db3')
    shutil.move(path, tmp_path / 'victim')
    if kind == 'out':
        path.symlink_to(tmp_path / 'victim')
    else:
        ODD[kind](path)
    with bounded(), pytest.raises(BagError, match=path.name):
        open_bag(external)


@pytest.mark.parametrize('kind', ['pipe', 'endless', 'huge', 'out', 'bomb', 'merge'])
def test_metadata_of_another_recorder_is_bounded(external, tmp_path, victim, kind):
    path = external / 'metadata.yaml'
    text = path.read_text()
    path.unlink()
    if kind in ('bomb', 'merge'):
        more = BOMB if kind == 'bomb' else 'a: {<<: {b: 1}}'
        path.write_text(f'{text}\n{more}\n')
    else:
        ODD[kind](path)
    with bounded(), pytest.raises(BagError, match=r'metadata\.yaml'):
        open_bag(external)


def test_a_person_may_name_a_file_by_a_link(external, tmp_path):
    [path] = external.glob('*.db3')
    (tmp_path / 'mine.db3').symlink_to(path)
    assert '/wheel/odometry' in open_bag(tmp_path / 'mine.db3').topics


zstd = rosbags_reader.zstd


def packed_zeros(n_bytes):
    packer = zstd.ZstdCompressor()
    block = bytes(2**24)
    parts = [packer.compress(block) for _ in range(n_bytes // len(block))]
    return b''.join([*parts, packer.flush()])


@pytest.mark.parametrize('name', ['bomb.mcap.zstd', 'bomb.db3.zstd'])
def test_what_unpacks_to_more_than_a_bag_is_refused(tmp_path, monkeypatch, name):
    monkeypatch.setattr('episode_store.rosbag2.unpacking.MOST_OF_A_BAG', 2**27)
    path = tmp_path / name
    path.write_bytes(packed_zeros(2**28))
    with bounded(), pytest.raises(BagError, match=r'more than 134217728 bytes; unpack it with'):
        open_bag(path)
    assert MOST_OF_A_BAG == 2**31


def test_a_packed_file_of_a_split_bag_is_bounded_too(tmp_path, monkeypatch):
    monkeypatch.setattr('episode_store.rosbag2.unpacking.MOST_OF_A_BAG', 2**27)
    folder = external_bag(tmp_path / 'drive', StoragePlugin.MCAP, CompressionMode.FILE)
    assert '/wheel/odometry' in open_bag(folder).topics
    [path] = folder.glob('*.zstd')
    path.write_bytes(packed_zeros(2**28))
    with bounded(), pytest.raises(BagError, match='more than 134217728 bytes'):
        open_bag(folder)


def test_a_message_or_chunk_becomes_no_more_than_it_says():
    data = zstd.compress(b'a' * 1000)
    assert unpack(data, 1000) == b'a' * 1000
    assert unpack(data + data, 2000) == b'a' * 2000
    for more in (lambda: unpack(data, 999), lambda: unpack(data + data, 1000)):
        with pytest.raises(ValueError, match='become more'):
            more()
    with pytest.raises(ValueError, match='end in the middle'):
        unpack(data[:-1], 1000)
    with pytest.raises(ValueError, match='more than 64 frames'):
        unpack(10**5 * zstd.compress(b''))
    assert unpack(_lz4.compress(b'a' * 1000), 1000, 'lz4') == b'a' * 1000
    with pytest.raises(ValueError, match='become more'):
        unpack(_lz4.compress(b'a' * 1000), 999, 'lz4')


def test_messages_packed_one_by_one_are_bounded(tmp_path, monkeypatch):
    folder = external_bag(tmp_path / 'drive', StoragePlugin.MCAP, CompressionMode.MESSAGE)
    assert len(open_bag(folder).messages('/wheel/odometry')) == 200
    monkeypatch.setattr('episode_store.rosbag2.unpacking.MOST_OF_A_CHUNK', 100)
    with pytest.raises(BagError, match='become more than the 100'):
        open_bag(folder).messages('/wheel/odometry')


def packed_chunks(path, n_chunks, n_bytes, is_whole):
    """Write an MCAP file whose chunks become far more than they are."""
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=2**20, compression=CompressionType.ZSTD)
        writer.start(profile='ros2')
        schema = writer.register_schema('nav_msgs/msg/Odometry', 'ros2msg', b'')
        channel = writer.register_channel('/odom', 'cdr', schema)
        for number in range(n_chunks):
            writer.add_message(channel, number, bytes(n_bytes), number)
        if is_whole:
            writer.finish()


@pytest.mark.parametrize('is_whole', [True, False])
def test_chunks_that_become_too_much_together_are_refused(tmp_path, monkeypatch, is_whole):
    path = tmp_path / 'bomb.mcap'
    packed_chunks(path, 40, 2**22, is_whole)
    assert path.stat().st_size < 2**20
    assert len(open_bag(path).messages('/odom')) >= 39
    monkeypatch.setattr('episode_store.rosbag2.unpacking.MOST_OF_A_BAG', 2**26)
    monkeypatch.setattr('episode_store.rosbag2.packed_mcap.MOST_IN_MEMORY', 2**26)
    with bounded(), pytest.raises(BagError, match='more than 67108864 bytes'):
        open_bag(path).messages('/odom')


@pytest.mark.parametrize('is_packed', [True, False])
def test_files_of_a_split_bag_become_no_more_together_than_one(tmp_path, monkeypatch, is_packed):
    folder = tmp_path / 'drive'
    folder.mkdir()
    for number in range(4):
        path = folder / f'drive_{number}.mcap'
        packed_chunks(path, 10, 2**20, True)
        if is_packed:
            path.with_name(f'{path.name}.zstd').write_bytes(zstd.compress(path.read_bytes()))
            path.unlink()
    assert len(open_bag(folder).messages('/odom')) == 40
    monkeypatch.setattr('episode_store.rosbag2.any_reader.MOST_IN_MEMORY', 2**24)
    with bounded(), pytest.raises(BagError, match='/odom has more than 16777216 bytes'):
        open_bag(folder).messages('/odom')


def test_a_bag_of_ros_1_has_a_bound(tmp_path, monkeypatch):
    path = ros1_bag(tmp_path / 'drive.bag', compression=Ros1Writer.CompressionFormat.BZ2)
    assert len(open_bag(path).messages('/odom')) == 100
    monkeypatch.setattr('episode_store.rosbag2.ros1_reader.MOST_IN_MEMORY', 10_000)
    with pytest.raises(BagError, match='more than 10000 bytes'):
        open_bag(path).messages('/odom')


def test_what_a_kill_left_of_a_draft_goes_when_the_folder_is_held(task):
    draft = task.find(2).path / '.metadata.yaml.abcd.tmp'
    draft.write_text('half')
    task.hold()
    assert not draft.exists()
    assert mcap_path(task.find(2).path).exists()
    assert isinstance(task, TaskFolder)
