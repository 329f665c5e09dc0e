"""`experience diff`: the numbers of two fields, and the picture."""

import json
import os
from pathlib import Path
import zipfile

import numpy as np
from PIL import Image
import pytest

from bridge_helpers import demonstration_bag
from control_field.headings import headings_from_vectors
from episode_store.episode import Episode
from episode_store.relearn import relearn
from experience_cli.main import main
from robot_bags import robot_bag
from sample_helpers import DEMO, FIRST, SECOND


@pytest.fixture
def diff(capsys):
    """Compare two fields; return the JSON object, or the text."""
    def call(first, second, *more):
        assert main(['diff', first, second, *(more or ('--json',))]) == 0
        out = capsys.readouterr().out
        return out if more else json.loads(out)

    return call


def test_a_field_does_not_differ_from_itself(task, diff):
    found = diff('bags/sample', 'bags/sample')
    assert (found['courses_differ'], found['vectors_equal']) == (0, True)
    assert found['prototypes'] == {'removed': [], 'added': [], 'turned': []}
    assert found['largest_q_difference'] == found['remembered_map_differs'] == 0
    assert 'the vectors are equal' in diff('bags/sample', 'bags/sample', '--bags', 'bags')


def test_a_saved_field_is_compared_with_all_that_it_tells(task, diff, capsys):
    assert main(['learn', '--quiet', 'bags/sample', '--save', 'field.npz']) == 0
    capsys.readouterr()
    found = diff('bags/sample', 'field.npz')
    same = set(found['first']) - {'name'}
    assert {key: found['first'][key] for key in same} == {
        key: found['second'][key] for key in same}
    assert found['first']['revision'] == 3


def test_a_damaged_field_is_one_line(task, capsys):
    assert main(['learn', '--quiet', 'bags/sample', '--save', 'field.npz']) == 0
    whole = Path('field.npz').read_bytes()
    for place in range(0, len(whole), len(whole) // 40):
        Path('field.npz').write_bytes(
            whole[:place] + bytes(byte ^ 0xFF for byte in whole[place:place + 9])
            + whole[place + 9:])
        capsys.readouterr()
        if main(['diff', 'field.npz', 'bags/sample', '--json']):
            [line] = capsys.readouterr().err.splitlines()
            assert 'field.npz is no saved field: ' in line


def test_a_path_may_hold_what_no_font_can_show(task, diff, capsys):
    for name in (os.fsdecode(b'f\xff.npz'), '$x^$.npz'):
        assert main(['learn', '--quiet', 'bags/sample', '--save', name]) == 0
        capsys.readouterr()
        assert diff('bags/sample', name)['vectors_equal']


def test_a_field_that_does_not_tell_its_bags_is_said_to(task, diff, capsys):
    assert main(['evaluate', '--world', 'task1', '--goal', '3.5,2.5', '--demo-start', '1,1',
                 '--trials', '1', '--seeds', '1', '--save-field', 'field.npz']) == 0
    capsys.readouterr()
    found = diff('bags/sample', 'field.npz')
    assert found['second']['revision'] is None
    assert found['second']['goal'] == [10, 14]
    text = diff('bags/sample', 'field.npz', '--bags', 'bags')
    assert 'not saved' in text


def test_the_numbers_are_those_of_the_fields(task, diff):
    recorded, final = Episode(task.find(2)), relearn(task.episodes())[0].refresh
    found = diff(FIRST, 'bags/sample')
    a, b = recorded.field(), final.field
    headings = [headings_from_vectors(field.vx, field.vy) for field in (a, b)]
    assert found['courses_differ'] == int((headings[0] != headings[1]).sum()) > 0
    assert found['courses_differ_cells'] == np.argwhere(headings[0] != headings[1]).tolist()
    cells = [set(map(tuple, prototypes.cells.tolist()))
             for prototypes in (recorded.prototypes(), final.prototypes)]
    assert {tuple(cell) for cell in found['prototypes']['added']} == cells[1] - cells[0]
    assert {tuple(cell) for cell in found['prototypes']['removed']} == cells[0] - cells[1]
    assert found['remembered_map_differs'] == int((a.known != b.known).sum())
    assert found['second']['basin'] == pytest.approx(final.certificate.basin)
    assert found['second']['proven'] == pytest.approx(final.certificate.proven)
    assert found['second']['fidelity'] == pytest.approx(final.certificate.fidelity)
    assert [found[side]['revision'] for side in ('first', 'second')] == [1, 3]


def test_it_is_the_same_the_other_way_round(task, diff):
    one, other = diff(FIRST, SECOND), diff(SECOND, FIRST)
    assert one['courses_differ'] == other['courses_differ']
    assert one['mean_angle_degrees'] == pytest.approx(other['mean_angle_degrees'])
    assert one['prototypes']['added'] == other['prototypes']['removed']
    assert one['first'] == other['second']


def test_a_saved_field_is_compared_with_what_it_was_saved_from(task, diff, capsys):
    assert main(['learn', 'bags/sample', '--save', 'field.npz', '--quiet']) == 0
    capsys.readouterr()
    found = diff('field.npz', 'bags/sample')
    assert found['vectors_equal']
    assert found['prototypes'] == {'removed': [], 'added': [], 'turned': []}
    assert found['first']['goal'] == found['second']['goal']


def test_the_picture_is_drawn_and_its_place_printed(task, diff):
    text = diff(FIRST, SECOND, '--out', 'made/here.png')
    assert text.splitlines()[-1] == 'made/here.png'
    with Image.open('made/here.png') as picture:
        pixels = np.asarray(picture.convert('RGB')).reshape(-1, 3)
    assert len(pixels) > 1_000_000
    for colour in ((0xb0, 0x65, 0x1d), (0x1f, 0x5f, 0xa8)):
        assert (np.abs(pixels.astype(int) - colour).max(axis=1) < 12).sum() > 200


@pytest.mark.parametrize(('first', 'second', 'says'), [
    (DEMO, FIRST, 'holds no field'),
    ('missing.npz', FIRST, 'cannot read missing.npz'),
    ('text.npz', FIRST, 'text.npz is no saved field'),
    ('sample/0042', FIRST, 'there is no bag 0042'),
    (FIRST, '../sample', 'leads out of the bags folder'),
])
def test_a_mistake_is_one_line(task, tmp_path, capsys, first, second, says):
    (tmp_path / 'text.npz').write_text('nothing of the kind')
    assert main(['diff', first, second]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert says in line


def test_fields_of_two_workspaces_are_refused_naming_both(task, capsys, tmp_path):
    np.savez(tmp_path / 'other.npz', vx=np.ones((3, 4)), vy=np.zeros((3, 4)),
             centres=np.array([[0.5, 0.5]]), actions=np.array([[1.0, 0.0]]), q=np.ones(1),
             origin=np.zeros(2), resolution=np.array(1.0))
    assert main(['diff', 'other.npz', 'bags/sample']) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert '3 x 4 cells of 1 m' in line
    assert '20 x 20 cells of 0.25 m' in line


def test_a_task_of_one_demonstration_can_be_compared(task, diff):
    demonstration_bag(task.root, n=100)
    assert diff('bags/task1', 'bags/sample')['goal_moved']


def test_the_picture_must_be_a_png(task, capsys):
    assert main(['diff', FIRST, SECOND, '--out', 'x.jpg']) == 2
    assert 'must end in .png' in capsys.readouterr().err


def test_a_saved_field_that_becomes_too_much_is_refused(task, capsys, monkeypatch):
    monkeypatch.setattr('experience_cli.field_comparison._MOST_UNPACKED', 2**20)
    with zipfile.ZipFile('bomb.npz', 'w', zipfile.ZIP_DEFLATED) as file:
        file.writestr('vx.npy', bytes(2**21))
    assert main(['diff', 'bomb.npz', 'bags/sample']) == 2
    assert 'bomb.npz is no saved field: it has 2097152 bytes unpacked' in (
        capsys.readouterr().err)


class TestBagsOfOthers:
    """Drives that others recorded are compared like ours, with the options of `learn`."""

    @pytest.fixture
    def theirs(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        robot_bag(tmp_path / 'tour')
        robot_bag(tmp_path / 'tour.bag', ros1=True, odometry=False)
        return tmp_path / 'tour'

    def test_what_is_recorded_twice_does_not_differ(self, theirs, diff, capsys):
        found = diff('tour', 'tour.bag')
        assert (found['courses_differ'], found['goal_moved']) == (0, False)
        assert [found[side]['name'] for side in ('first', 'second')] == ['tour', 'tour.bag']
        found = diff('tour', 'tour.bag', '--to', '3', '--rows', '12', '--cols', '20', '--json')
        assert json.loads(found)['cells'] == 240

    def test_the_workspace_is_that_of_the_other_field(self, theirs, diff, capsys):
        words = ['--rows', '30', '--cols', '25', '--origin', '-1', '-1']
        assert main(['learn', 'tour', '--into', 'bags/theirs', *words]) == 0
        assert main(['learn', 'tour', *words, '--save', 'field.npz']) == 0
        capsys.readouterr()
        for other in 'bags/theirs', 'field.npz':
            for pair in (other, 'tour'), ('tour', other):
                assert main(['diff', *pair, '--json']) == 0
                said = capsys.readouterr()
                found = json.loads(said.out)
                assert (found['cells'], found['courses_differ']) == (750, 0)
                assert 'experience diff: tour is a bag of another recorder' in said.err

    @pytest.mark.parametrize('words', [
        ('tour', 'bags/theirs', '--rows', '7'), ('bags/theirs', 'bags/theirs', '--rows', '7'),
        ('tour', 'nowhere'), ('tour', 'tour.bag', '--odom-topic', '/there')], ids=str)
    def test_a_mistake_is_one_line(self, theirs, capsys, words):
        assert main(['learn', 'tour', '--into', 'bags/theirs']) == 0
        capsys.readouterr()
        assert main(['diff', *words]) == 2
        assert capsys.readouterr().err.splitlines()[-1].startswith('experience diff: ')
