"""How the robot learnt: what every episode came to, and the field after each."""

import json
import shutil

import numpy as np
import pytest

from episode_store.relearn import relearn
from page_node.field_frames import HOME
from page_node.refusal import RefusedError
from page_node.story import story
from page_node.story.frame import frame_after
from page_node.story.story import story_of
from sample_helpers import rewritten, sample_copy


@pytest.fixture
def task(tmp_path):
    return sample_copy(tmp_path)


def asked(task):
    return story_of(str(task.root), task.task)


def frame(task, number):
    """Return header and arrays of the field after an episode."""
    content = frame_after(str(task.root), task.task, number)
    size = int.from_bytes(content[:4], 'little')
    header, at = json.loads(content[4:4 + size]), 4 + size
    arrays = {}
    for column in header.pop('arrays'):
        kind = np.dtype(column['dtype']).newbyteorder('<')
        n = int(np.prod(column['shape']))
        arrays[column['name']] = np.frombuffer(content, kind, n, at).reshape(column['shape'])
        at += n * kind.itemsize
    assert at == len(content)
    return header, arrays


def test_every_episode_says_what_it_came_to(task):
    told = asked(task)
    demo, first, second = told['episodes']
    _, learnt = relearn(task.episodes())
    assert (told['task'], told['complete']) == ('sample', True)
    assert [row['name'] for row in told['episodes']] == [
        'sample/0001', 'sample/0002', 'sample/0003']
    assert (demo['kind'], demo['outcome'], demo['steps']) == ('demo', '', 15)
    for row, bag in zip((first, second), learnt[1:], strict=True):
        assert (row['kind'], row['outcome']) == ('trial', 'goal')
        assert row['steps'] == bag.content.record.n_steps
        assert row['reinforcements'] == bag.refresh.reinforcements
        assert row['collisions'] == 0
    assert (first['reinforcements'], second['reinforcements']) == (7, 0)
    # What came of an episode stands at the beginning of the next.
    assert [row['prototypes'] for row in told['episodes']] == [
        len(bag.refresh.prototypes) for bag in learnt[:2]] + [None]
    assert second['field'] is None
    assert first['field'] != demo['field']


def test_the_field_after_an_episode_is_the_one_that_was_learnt_then(task):
    _, learnt = relearn(task.episodes())
    for number in (1, 2):
        header, arrays = frame(task, str(number))
        field = learnt[number - 1].refresh.field
        assert (header['type'], header['number'], header['revision']) == (
            'story_field', number, number)
        assert (header['rows'], header['cols']) == field.grid.shape
        np.testing.assert_array_equal(arrays['known'], field.known)
        turned = arrays['angle'] * (2 * np.pi / 256)
        there = field.vx**2 + field.vy**2 > 0
        np.testing.assert_allclose(np.cos(turned)[there], field.vx[there], atol=0.02)
        assert (arrays['flags'] & HOME).any()
        assert 10 < len(arrays['way_x']) == len(arrays['way_y']) <= 600
    # Nobody has recorded yet what the last one has led to.
    header, arrays = frame(task, '3')
    assert header == {'type': 'story_field', 'number': 3}
    assert set(arrays) == {'way_x', 'way_y'}


@pytest.mark.parametrize('number', ['9', 'x', '-1', '../0001', '１'])
def test_what_is_not_there_is_refused(task, number):
    with pytest.raises(RefusedError) as caught:
        frame(task, number)
    assert caught.value.code == 'gone'
    with pytest.raises(RefusedError):
        story_of(str(task.root), '../sample')


def test_what_was_forgotten_still_says_what_the_field_was(task):
    before, _ = frame(task, '1'), asked(task)
    (task.path / '.forgotten').mkdir()
    shutil.move(task.find(2).path, task.path / '.forgotten')
    demo, second = asked(task)['episodes']
    assert (demo['number'], second['number']) == (1, 3)
    assert demo['field'] is not None
    after = frame(task, '1')
    assert after[0] == before[0]
    np.testing.assert_array_equal(after[1]['angle'], before[1]['angle'])


def test_what_teaches_nothing_is_no_part_of_it(task):
    field = frame(task, '2')
    without_trial = rewritten(task, 3, lambda topic, type_name, message: [
        (topic, type_name, message)] if topic not in ('/trial', '/experience') else [])
    assert without_trial.number == 4
    task.find(3).bag.write_bytes(b'no bag at all')
    told = asked(task)
    assert told['complete']
    assert [row['number'] for row in told['episodes']] == [1, 2]
    # The third cannot be read, and taught nothing: the fourth began with the same field.
    assert told['episodes'][1]['field'] is not None
    again = frame(task, '2')
    assert again[0] == field[0]
    np.testing.assert_array_equal(again[1]['angle'], field[1]['angle'])


def test_many_bags_are_read_bit_by_bit(task, monkeypatch):
    monkeypatch.setattr(story, '_READS_FOR', -1.0)
    monkeypatch.setattr(story, '_kept', type(story._kept)())
    assert asked(task) == {'task': 'sample', 'episodes': [], 'complete': False}
    monkeypatch.setattr(story, '_READS_FOR', 60.0)
    assert asked(task)['complete']
    monkeypatch.setattr(story, '_READS_FOR', -1.0)
    assert len(asked(task)['episodes']) == 3  # what was read once is kept in mind
