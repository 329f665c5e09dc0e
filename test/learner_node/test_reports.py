"""What people read of a lesson: a plain sentence first, numbers after, and where to look."""

import pytest

from bridge_helpers import demonstration_bag, GRID
from control_field.parameters import Parameters
from learner_node.lessons import Lessons
from learner_node.library import Library
from learner_node.reports import sentence_from_lesson
from msgs_bridge.bag_folder import TaskFolder


@pytest.fixture
def task(tmp_path):
    demonstration_bag(tmp_path)
    return TaskFolder(tmp_path, 'task1')


def test_a_demonstration_is_said_plainly_before_its_numbers(task):
    lesson = Lessons(GRID, Parameters()).learn(task.episodes()[0])
    plain, _, numbers = sentence_from_lesson(lesson).partition(' (')
    assert plain.startswith('Drive 0001 kept: ')
    assert plain.endswith('Press t in teleop_node to let the robot try.')
    assert 'cells from 200 poses' in numbers
    assert 'prototypes' in numbers


def test_places_are_told_of_in_metres(task):
    library = Library(task, GRID, Parameters())
    library.find_places()
    assert library.places == {'start': '', 'teach_here': ''}
    library.relearn()
    library.find_places()
    x, y, yaw = map(float, library.places['start'].split())
    assert GRID.cell_from_world(x, y) == (2, 2)
    assert -3.2 < yaw < 3.2
    spots = [tuple(map(float, spot.split())) for spot in library.places['teach_here'].split(';')]
    assert spots
    assert all(GRID.contains(*GRID.cell_from_world(*spot)) for spot in spots)
