"""`experience show` of any bag: what is in it, also where there is nothing to learn."""

import json

import numpy as np
import pytest

from experience_cli.drive_drawing import drawing_lines
from experience_cli.main import main
from external_bags import drive_bag, ros1_bag
from robot_bags import robot_bag


@pytest.fixture
def show(capsys):
    """Show a bag, which must do; return the lines, or what is printed as JSON."""
    def call(*words):
        assert main(['show', *map(str, words)]) == 0
        out = capsys.readouterr().out
        return json.loads(out) if '--json' in words else out.splitlines()

    return call


def test_a_bag_without_a_drive_is_shown_all_the_same(tmp_path, show):
    bag = drive_bag(tmp_path / 'bag', {'cmd_vel': '/cmd_vel', 'map': '/map'})
    lines = show(bag, '--out', tmp_path / 'x.png')
    assert lines[0] == f'{bag}: a bag of another recorder'
    assert 'does not learn it: no topic is odom' in lines[1]
    assert '/cmd_vel geometry_msgs/msg/Twist 200' in [' '.join(line.split()) for line in lines]
    assert (tmp_path / 'x.png').read_bytes().startswith(b'\x89PNG')
    about = show(bag, '--json')
    assert (about['would_be_learnt'], about['sources'], about['learnt_from']) == (False, [], None)
    assert about['seconds'] == pytest.approx(9.95)


def test_one_that_leaves_open_whose_drive_it_is_shows_both(tmp_path, show):
    bag = drive_bag(tmp_path / 'bag', {'odom': '/a/odom', 'other': '/b/odom'})
    about = show(bag, '--json')
    assert 'Name one of /a/odom (Odometry), /b/odom (Odometry)' in about['refusal']
    assert [each['topic'] for each in about['sources']] == ['/a/odom', '/b/odom']
    assert [round(each['way'], 1) for each in about['sources']] == [2.0, 0.0]
    assert show(bag, '--json', '--odom-topic', '/a/odom')['would_be_learnt']


def test_ros_1_and_frames_are_sources_like_others(tmp_path, show):
    about = show(ros1_bag(tmp_path / 'tour.bag'), '--json')
    assert (about['would_be_learnt'], about['why']) == (True, 'it is called so')
    [source] = about['sources']
    assert (source['poses'], round(source['rate'])) == (100, 20)
    about = show(robot_bag(tmp_path / 'tf', odometry=False), '--json')
    assert (about['learnt_from'], about['why']) == ('/tf', 'no topic is Odometry')


def test_a_bag_of_ours_is_drawn_as_well(tmp_path, show):
    lines = show('sample/0001', '--out', tmp_path / 'x.png')
    assert any(line.startswith('extent ') and ' m, y from ' in line for line in lines)
    assert any(line.startswith('(S start, G end; a letter is ') for line in lines)
    assert lines[-1] == str(tmp_path / 'x.png')


class TestDrawing:

    def test_every_letter_on_the_way_is_there(self):
        corners = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 4.0), (0.0, 4.0)])
        *lines, _ = drawing_lines(corners)
        assert (lines[0][0], lines[-1][0]) == ('G', 'S')
        assert set(lines[0][1:]) == set(lines[-1][1:]) == {'*'}
        assert all(line.strip() == '*' for line in lines[1:-1])

    def test_loops_have_a_letter_of_their_own(self):
        path = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.01), (3.0, 0.0)])
        text = '\n'.join(drawing_lines(path, np.array([0, 1, 1, 1, 1, 0], dtype=bool)))
        assert ': a loop that is not learnt' in text
        assert text.count(':') > 10

    @pytest.mark.parametrize('path', [np.zeros((0, 2)), np.zeros((1, 2))], ids=len)
    def test_nothing_is_nothing(self, path):
        assert drawing_lines(path) == []

    def test_it_stays_within_bounds_however_large_it_is(self):
        rng = np.random.default_rng(1)
        for size in (1e-6, 1.0, 1e6):
            lines = drawing_lines(size * rng.normal(size=(500, 2)) + 5e6)
            assert max(map(len, lines[:-1])) <= 72
            assert len(lines) <= 21
