"""What is wrong with a bag is said, and the bag left as it is."""

import shutil

import pytest

from bridge_helpers import demonstration_bag
from episode_store.episode import Episode
from episode_store.lock import changing
from episode_store.repair import repair_bag
from episode_store.rosbag2.errors import mcap_path
from episode_store.rosbag2.metadata import NAME
from episode_store.task_folder import TaskFolder


@pytest.fixture
def folder(tmp_path):
    return demonstration_bag(tmp_path)


def damage_of(folder):
    return Episode.at(folder).damage


def test_of_a_whole_bag_nothing_is_missing(folder):
    assert Episode.at(folder).is_closed
    assert not damage_of(folder)
    assert damage_of(folder).state == ''


def test_wherever_it_is_cut_it_is_said_what_is_missing(tmp_path):
    folder = demonstration_bag(tmp_path, n=40)
    path = mcap_path(folder)
    whole = path.read_bytes()
    for n in [*range(1, 65), *range(66, 4097, 31)]:
        path.write_bytes(whole[:-n])
        episode = Episode.at(folder)
        assert not episode.is_closed
        said = episode.damage.cut
        assert 'it ends without its index' in said or 'is cut' in said
        assert 'message is missing' in said or 'cannot be read' in said or 'came after' in said
        assert episode.damage.state == 'cut'
        assert path.stat().st_size == len(whole) - n


def test_a_cut_bag_whose_task_is_held_is_being_recorded(folder):
    path = mcap_path(folder)
    path.write_bytes(path.read_bytes()[:-400])
    with changing(folder.parent):
        assert damage_of(folder).is_busy
        assert damage_of(folder).state == 'recording'
    assert damage_of(folder).state == 'cut'


def test_what_was_taken_out_of_the_memory_is_so_whatever_else_is_wrong_with_it(folder):
    path = mcap_path(folder)
    path.write_bytes(path.read_bytes()[:-400])
    taken = TaskFolder(folder.parent.parent, folder.parent.name).forget(1)
    damage = damage_of(taken.path)
    assert damage.is_forgotten
    assert damage.cut
    assert damage.state == 'forgotten'


@pytest.mark.parametrize('part', [0.1, 0.3, 0.5, 0.8, 0.95])
def test_it_is_what_mending_says(folder, part):
    path = mcap_path(folder)
    n_recorded = repair_bag(folder).n_messages
    path.write_bytes(path.read_bytes()[:int(part * path.stat().st_size)])
    said = damage_of(folder).cut
    report = repair_bag(folder)
    assert said.startswith(report.damage)
    if report.n_messages < n_recorded:
        assert f'; {report.n_messages} of {n_recorded} messages can be read' in said
    if not report.complete:
        assert f'the last at {report.last_time / 1e9:.3f} s' in said
        assert f'{report.n_lost_bytes} byte' in said


def test_a_bag_without_its_metadata_or_file_or_with_an_empty_one(folder, tmp_path):
    (folder / NAME).rename(tmp_path / NAME)
    assert not Episode.at(folder).is_closed
    assert damage_of(folder).cut == 'metadata.yaml is missing; no message is missing'
    shutil.copyfile(tmp_path / NAME, folder / NAME)
    for content in (b'', None):
        mcap_path(folder).unlink()
        if content is not None:
            mcap_path(folder).write_bytes(content)
        assert not Episode.at(folder).is_closed
        assert damage_of(folder).cut == 'it is empty: its recorder was stopped at once'


def test_what_is_no_bag_is_said_to_be_none(folder):
    mcap_path(folder).write_bytes(b'something else, and long enough to look at')
    damage = damage_of(folder)
    assert 'it is no MCAP file' in damage.unreadable
    assert damage.state == 'unreadable'
