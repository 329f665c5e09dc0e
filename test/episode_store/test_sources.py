"""Where a prototype comes from is said of where it was shown, tried, or driven again."""

import json
import shutil

import pytest
from rclpy.serialization import serialize_message

from control_field.records import Kind
from episode_store.episode import Episode
from episode_store.rosbag2.topic_tables import decision_table
from episode_store.sources import Sources
from experience_cli.main import main
from msgs_bridge.messages.tables import cloud_from_decisions
from sample_helpers import DEMO, FIRST, rewritten, sample_copy, SECOND


@pytest.fixture
def task(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return sample_copy(tmp_path)


@pytest.mark.parametrize(('bag', 'source'), [
    (FIRST, f'{DEMO} at 0.00 s (shown)'),
    (SECOND, f'{FIRST} at 0.00 s (driven again as shown)')])
def test_a_trial_that_drives_what_was_shown_has_not_shown_it(task, capsys, bag, source):
    assert main(['explain', bag, '--at', '0', '--json']) == 0
    [voice] = json.loads(capsys.readouterr().out)['course']['prototypes']
    assert (voice['demonstrated'], voice['from']) == (True, source)


def test_what_a_person_drove_in_a_trial_was_shown_there(task):
    def change(topic, type_name, message):
        return [(topic, type_name, decisions if topic == '/experience' else message)]

    recording = Episode(task.find(3))
    grid = recording.header.grid
    rows = decision_table(recording.messages('experience'), grid)[0]
    half = len(rows) // 2
    rows['kind'][half:] = Kind.TAUGHT
    decisions = serialize_message(cloud_from_decisions(rows, grid))
    number = rewritten(task, 3, change).number
    sources = Sources(task)
    first, last = (float(rows['stamp'][i]) for i in (0, -1))
    assert sources.text(number, first, True).endswith('(driven again as shown)')
    assert sources.text(number, first, False).endswith('(tried)')
    assert sources.text(number, last, True).endswith('(shown)')


def test_of_a_bag_that_is_gone_it_is_not_said_who_drove(task):
    shutil.rmtree(task.find(1).path)
    assert Sources(task).text(1, 2.0, True) == (
        f'{DEMO} at stamp 2.00 s, its bag is gone (as shown)')
