"""What the memory answers, whatever state a bag is in: each has an answer for a person."""

import shutil
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from benchmarks.long_drive import write_long_trial
from bridge_helpers import demonstration_bag, OCCUPANCY
from control_field.records import Kind
from episode_store.episode import Episode
from episode_store.lock import changing
from episode_store.rosbag2.metadata import NAME
from frame_helpers import frame_from_bytes
from page_node.memory.field_at import field_at, prototypes_at
from page_node.memory.replay import replay_of
from page_node.memory.rows import list_of
from page_node.memory.thumbnail import thumbnail_of
from page_node.memory.why import why
from page_node.refusal import RefusedError
from ros_helpers import wait_until
from sample_helpers import rewritten, sample_copy


@pytest.fixture
def task(tmp_path):
    return sample_copy(tmp_path)


def listed(task):
    """Return the list once all of it was read, however slow the machine."""
    return wait_until(lambda: next(filter(
        lambda found: found['complete'], [list_of(str(task.root), task.task)]), None))


def row_of(task, number):
    [row] = [each for each in listed(task)['episodes'] if each['number'] == number]
    return row


def asked(function, task, number, *more):
    return function(str(task.root), task.task, str(number), *more)


def refused(function, task, number, *more):
    with pytest.raises(RefusedError) as found:
        asked(function, task, number, *more)
    return found.value.code


def test_every_drive_and_trial_is_a_row_the_newest_first(task):
    task.forget(2)
    found = listed(task)
    assert [row['name'] for row in found['episodes']] == [
        'sample/0003', 'sample/0002', 'sample/0001']
    assert found['tasks'] == ['sample']
    third, second, first = found['episodes']
    assert (first['kind'], first['learnt'], first['steps']) == ('demo', True, 15)
    assert (third['outcome'], third['seconds'], third['state']) == ('goal', 19.4, 'kept')
    assert second['forgotten']
    assert second['reinforcements'] == 6


def test_a_long_list_comes_in_parts(task, monkeypatch):
    monkeypatch.setattr('page_node.memory.rows._READS_FOR', -1.0)
    found = list_of(str(task.root), 'sample')
    assert not found['complete']
    assert {row['state'] for row in found['episodes']} == {'unread'}
    monkeypatch.undo()
    assert listed(task)['complete']


def test_what_others_recorded_is_named(task):
    (task.path / 'rosbag2_2026').mkdir()
    (task.path / 'rosbag2_2026' / 'drive.db3').write_bytes(b'')
    (task.root / 'drive.bag').write_bytes(b'')
    (task.root / 'link').symlink_to('/')
    assert list_of(str(task.root), 'sample')['others'] == ['drive.bag', 'rosbag2_2026']


def test_a_label_and_a_change_of_a_bag_make_another_row(task):
    before = row_of(task, 3)
    Episode(task.find(3)).judge('failure')
    after = row_of(task, 3)
    assert after['label'] == 'failure'
    assert before['version'] != after['version']


def test_a_drive_is_gone_through_pose_by_pose(task):
    header, arrays = frame_from_bytes(asked(replay_of, task, 2))
    poses, start = Episode(task.find(2)).poses, Episode(task.find(2)).start
    np.testing.assert_allclose(arrays['t'], poses.stamps - start, atol=1e-5)
    np.testing.assert_allclose(arrays['x'], poses.xyyaw[:, 0], atol=1e-5)
    assert header['seconds'] == pytest.approx(19.4)
    assert header['fields'] == [0.0]
    assert [status['state'] for status in header['statuses']] == ['running', 'ended']
    assert set(arrays['d_kind']) <= set(Kind)
    assert len(arrays['d_t']) == len(Episode(task.find(2)).decisions)
    assert np.isfinite(arrays['v']).all()


def test_the_field_of_a_moment_is_the_one_recorded_and_a_drive_before_shows_ground(task):
    header, arrays = frame_from_bytes(asked(field_at, task, 2, 5.0))
    field = Episode(task.find(2)).field()
    assert (header['type'], header['revision']) == ('field', field.revision)
    np.testing.assert_array_equal(arrays['known'], field.known)
    angles = arrays['angle'] * np.pi / 128
    points = arrays['flags'] & 32 != 0
    np.testing.assert_allclose(np.cos(angles)[points], field.vx[points], atol=0.03)
    assert (arrays['flags'] & 16 != 0).any()
    _, arrays = frame_from_bytes(asked(prototypes_at, task, 2, 5.0))
    assert len(arrays['x']) == len(Episode(task.find(2)).prototypes())
    header, arrays = frame_from_bytes(asked(field_at, task, 1, 5.0))
    assert header['revision'] == -1
    assert not arrays['flags'].any()
    assert (arrays['known'] == 0).any()
    assert len(frame_from_bytes(asked(prototypes_at, task, 1, 5.0))[1]['x']) == 0


def test_a_picture_shows_the_way_from_start_to_end(task):
    for number in (1, 2):
        picture = ET.fromstring(asked(thumbnail_of, task, number))
        [line] = picture.findall('{*}polyline')
        points = np.array([point.split(',') for point in line.get('points').split()], float)
        assert (points >= 0).all()
        assert (points <= [120, 90]).all()
        way = Episode(task.find(number)).poses.xyyaw[[0, -1], :2]
        # y runs down on the picture.
        drawn, driven = (np.sign(np.round(ends[1] - ends[0])) for ends in (points[[0, -1]], way))
        np.testing.assert_array_equal(drawn, driven * [1, -1])


def test_why_has_codes_and_where_it_comes_from(task):
    about = asked(why, task, 2, 9.0)
    assert about['decision'][-1]['kind'] == 'field'
    assert about['course']['prototypes'][0]['episode'] == 1
    assert about['no_heading'] is None
    assert about['trial']['stop_reason'] == ''
    assert asked(why, task, 1, 3.0)['no_heading'] == 'not_yet'
    # Past the end is the end: the scrubber's last place is rounded.
    assert asked(why, task, 2, 19.4001)['at'] == pytest.approx(19.4)


@pytest.mark.parametrize('function', [replay_of, thumbnail_of])
def test_a_bag_that_is_gone_or_never_was(task, function):
    asked(function, task, 2)
    task.remove(2)
    assert refused(function, task, 2) == 'gone'
    for number in ('99', '2x', '', '-1', '../1', '٣'):
        assert refused(function, task, number) == 'gone'
    with pytest.raises(RefusedError) as found:
        function(str(task.root), '../sample', '1')
    assert found.value.code == 'no_task'


def test_a_cut_bag_shows_what_is_left_of_it(task):
    path = task.find(2).bag
    path.write_bytes(path.read_bytes()[:len(path.read_bytes()) // 2])
    assert row_of(task, 2)['damage'] == 'cut'
    header, arrays = frame_from_bytes(asked(replay_of, task, 2))
    assert header['damage'] == 'cut'
    assert 'missing' in header['note'] or 'cannot be read' in header['note']
    assert 0 < len(arrays['t']) < 195
    assert asked(why, task, 2, 0.5)['decision']


def test_a_bag_that_is_recorded_just_now_grows(tmp_path):
    folder = demonstration_bag(tmp_path / 'bags', n=200)
    path = folder / f'{folder.name}_0.mcap'
    (folder / NAME).unlink()
    whole = path.read_bytes()
    lengths = []
    with changing(folder.parent):
        for share in (0.5, 0.8):
            path.write_bytes(whole[:round(share * len(whole))])
            header, arrays = frame_from_bytes(replay_of(str(tmp_path / 'bags'), 'task1', '1'))
            lengths.append(len(arrays['t']))
            assert header['damage'] == 'recording'
    assert 0 < lengths[0] < lengths[1] < 200


def test_nothing_damaged_or_foreign_is_a_mistake(task):
    path = task.find(2).bag
    whole = path.read_bytes()
    for content in (b'', b'rubbish', whole[:40], whole[:2000], b'\0' * 5000, whole[:-1]):
        path.write_bytes(content)
        assert row_of(task, 2)['damage']
        for function, more in ((replay_of, ()), (thumbnail_of, ()), (why, (1.0,)),
                               (field_at, (1.0,)), (prototypes_at, (1.0,))):
            code = ''
            try:
                asked(function, task, 2, *more)
            except RefusedError as error:
                code = error.code
            assert code in ('', 'unreadable', 'nothing', 'no_moment')
    # A bag of another recorder under a name of ours.
    shutil.rmtree(task.find(3).path)
    external = task.path / '0003_trial'
    external.mkdir()
    (external / 'drive.db3').write_bytes(b'SQLite format 3\0')
    assert not row_of(task, 3)['learnt']
    assert row_of(task, 3)['note']
    assert refused(replay_of, task, 3) in ('nothing', 'unreadable')


def test_two_bags_of_one_number_are_told(task):
    shutil.copytree(task.find(2).path, task.path / '0002_demo')
    with pytest.raises(RefusedError) as found:
        list_of(str(task.root), 'sample')
    assert found.value.code == 'folder'
    assert 'same number' in found.value.message


def test_where_nothing_was_recorded_nothing_is_explained(task):
    start, messages = Episode(task.find(2)).start, []

    def without(topic, type_name, cdr):
        if topic == '/odom':
            messages.append(topic)
            if 60 < len(messages) < 120:
                return []
        return [(topic, type_name, cdr)]

    holed = rewritten(task, 2, without)
    header, _ = frame_from_bytes(asked(replay_of, task, holed.number))
    [[first, last]] = header['holes']
    assert last - first > 5.0
    assert header['damage'] == 'incomplete'
    assert refused(why, task, holed.number, (first + last) / 2) == 'hole'
    assert start > 0.0


def test_a_drive_without_odometry_has_nothing_to_show(task):
    empty = rewritten(task, 2, lambda topic, *rest: (
        [] if topic == '/odom' else [(topic, *rest)]))
    assert refused(replay_of, task, empty.number) == 'nothing'
    assert refused(thumbnail_of, task, empty.number) == 'nothing'
    assert refused(why, task, empty.number, 0.0) == 'no_moment'


def test_a_robot_that_was_nowhere_is_passed_over(task):
    def lost(topic, type_name, cdr):
        if topic == '/odom' and len(seen) % 3 == 2:
            cdr = bytearray(cdr)
            # The first of the doubles of the pose comes after header and child frame.
            at = bytes(cdr).index(np.float64(xs[len(seen)]).tobytes())
            cdr[at:at + 8] = np.float64(1e300 if len(seen) % 2 else np.nan).tobytes()
        if topic == '/odom':
            seen.append(topic)
        return [(topic, type_name, bytes(cdr))]

    seen, xs = [], Episode(task.find(2)).poses.xyyaw[:, 0]
    odd = rewritten(task, 2, lost)
    _, arrays = frame_from_bytes(asked(replay_of, task, odd.number))
    assert len(arrays['t']) == 195 - 195 // 3
    assert np.isfinite(arrays['x']).all()
    assert b'nan' not in asked(thumbnail_of, task, odd.number)


def test_a_drive_is_thinned_and_wide_local_grids_show_far(tmp_path):
    folder = write_long_trial(tmp_path, 'long', 20.0)
    header, arrays = frame_from_bytes(replay_of(str(tmp_path), 'long', '1'))
    assert len(arrays['t']) == pytest.approx(20 * 20, abs=2)
    assert arrays['t'][-1] == pytest.approx(header['seconds'])
    assert len(arrays['g_t']) < 200
    # Without its field the ground is what was seen, farther than the nine cells around.
    task = folder.task
    bare = rewritten(task, 1, lambda topic, *rest: (
        [] if topic in ('/control_field', '/prototypes') else [(topic, *rest)]))
    header, arrays = frame_from_bytes(field_at(str(tmp_path), 'long', str(bare.number), 1.0))
    assert header['revision'] == -1
    assert header['rows'] > 15
    assert (arrays['known'] == 100).any()


def test_local_grids_of_another_kind_do_not_hide_the_drive(task):
    odd = rewritten(task, 1, lambda topic, type_name, cdr: [
        (topic, type_name, cdr[:60] if type_name == OCCUPANCY else cdr)])
    header, arrays = frame_from_bytes(asked(replay_of, task, odd.number))
    assert len(arrays['t']) == 202
    assert len(arrays['g_t']) == 0
    assert header['type'] == 'replay'
