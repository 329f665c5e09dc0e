"""Names that hold codes for a terminal: on the screen they are shown, whoever says them."""

from contextlib import suppress
import unicodedata

import pytest

from bridge_helpers import GRID, nanoseconds, ODOMETRY, raw_odometry
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.errors import BagError, mcap_path
from episode_store.rosbag2.metadata import write_metadata
from episode_store.rosbag2.type_definitions import message_definition
from episode_store.rosbag2.writer import McapFile
from episode_store.task_folder import EpisodeKind
from experience_cli.main import main
from msgs_bridge.node.run import exit_with
from teleop_node.status_line import line_over, message_over

CODES = '/odom\x1b]0;owned\x07\x1b[2J\u202e\nexperience: all is well'


@pytest.fixture
def bag(tmp_path, monkeypatch):
    """Return a bag of ours whose topic, frame and header hold codes."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / 'bags' / 'task1' / '0001_demo'
    folder.mkdir(parents=True)
    file = McapFile(mcap_path(folder), EpisodeHeader(
        EpisodeKind.DEMO, 'task1', GRID).to_mapping())
    file.add_channel(CODES, ODOMETRY, message_definition(ODOMETRY).encode(), {})
    for i in range(20):
        file.add(CODES, raw_odometry(i, 0.5 + i / 10, 0.5, CODES), nanoseconds(i), 0)
    write_metadata(folder, file.finish(mcap_path(folder).name))
    return folder


def is_safe(text):
    return all(unicodedata.category(each) not in ('Cc', 'Cf') for each in text.replace('\n', ''))


@pytest.mark.parametrize('arguments', [
    ['list'], ['show', 'task1/0001'], ['learn', 'bags/task1'], ['explain', 'task1/0001'],
    ['repair', 'bags/task1'], ['learn', 'bags/task1/0001_demo', '--into', CODES],
    ['show', CODES], ['list', CODES]])
def test_no_command_sends_them(bag, capsys, arguments):
    with suppress(SystemExit):
        main(arguments)
    out, err = capsys.readouterr()
    assert out + err
    assert is_safe(out + err)
    assert not any(line.startswith('experience: ') for line in (out + err).splitlines())


def test_an_error_of_a_bag_is_one_line():
    assert str(BagError(f'no topic {CODES}')) == (
        r'no topic /odom\x1b]0;owned\x07\x1b[2J\u202e\nexperience: all is well')


def test_a_node_that_ends_does_not_send_them(capsys):
    with pytest.raises(SystemExit):
        exit_with('sim_node', f'cannot read {CODES}')
    assert is_safe(capsys.readouterr().err)


def test_the_line_of_teleop_does_not_send_them():
    for line in (line_over(CODES), message_over(CODES)):
        text = line.removeprefix('\r').removesuffix('\n').removesuffix('\x1b[K')
        assert text == (r'/odom\x1b]0;owned\x07\x1b[2J\u202e\nexperience: all is well')
