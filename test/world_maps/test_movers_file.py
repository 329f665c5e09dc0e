"""Files of what moves and what changes: what they say, and what is refused in which words."""

from pathlib import Path

import numpy as np
import pytest

from control_field.grid import Grid
from world_maps.changes import ChangingWorld
from world_maps.mover import Mover, Waypoint
from world_maps.movers import Disc
from world_maps.movers_file import find_movers, load_movers
from world_maps.world import find_world, load_world, save_world, World

WORLD = World(Grid(4, 6, 0.5), np.zeros((4, 6), dtype=np.int8), 'here')


@pytest.fixture
def read(tmp_path):
    def read_text(text, world=WORLD):
        path = tmp_path / 'movers.yaml'
        path.write_text(text)
        return load_movers(path, world)

    return read_text


def test_what_moves(read):
    script = read("""
movers:
  - {name: person, radius: 0.15, speed: 0.1, waypoints: [[1, 0.5], [2.5, 0.5, 3]], start: 5,
     mode: back_and_forth, patience: 0}
  - {radius: 0.1, mode: once, waypoints: [[1, 1, 2]], comes_every: 30}
  - {radius: 0.1, mode: wander}
""")
    assert script.movers == (
        Mover(0.15, 0.1, (Waypoint(1.0, 0.5), Waypoint(2.5, 0.5, 3.0)), 'back_and_forth', 5.0, 0.0,
              0.0, 'person'),
        Mover(0.1, waypoints=(Waypoint(1.0, 1.0, 2.0),), mode='once', comes_every=30.0),
        Mover(0.1, mode='wander'))
    assert script.changes == ()


@pytest.mark.parametrize('world', ['task1', 'task2'])
def test_the_examples_can_be_read(world):
    for name in ('crossing', 'door'):
        script = load_movers(find_movers(name), load_world(find_world(world)))
        assert script.movers
    assert [change.at_trial for change in script.changes] == [6, 6, 11]
    assert [int(change.cells.sum()) for change in script.changes] == [2, 2, 2]


@pytest.mark.parametrize(('text', 'words'), [
    ('- 3', 'must have the keys movers and changes'),
    ('', 'must have the keys movers and changes'),
    ('robots: []', 'must have the keys movers and changes'),
    ('movers: 3', 'movers must be a list'),
    ('movers: [3]', "entry 1 of movers: is '3', must have keys"),
    ('movers: [{radius: 1, radius: 2}]', "'radius' twice"),
    ('movers: [{speed: 1}]', 'entry 1 of movers: radius is missing'),
    ('movers: [{radius: big}]', "radius is 'big', must be a number"),
    ('movers: [{radius: -1, mode: wander}]', 'radius is -1, must be between 0.001 and 100'),
    ('movers: [{radius: nan, mode: wander}]', 'radius is nan, must be between'),
    ('movers: [{radius: 0.1}]', r'waypoints must be at least one \[x, y\]'),
    ('movers: [{radius: 0.1, waypoints: [[1]]}]', r'must be \[x, y\] in metres'),
    ('movers: [{radius: 0.1, waypoints: 1}]', 'waypoints must be a list'),
    ('movers: [{radius: 0.1, mode: hop, waypoints: [[1, 1]]}]', "mode is 'hop', must be one of"),
    ('movers: [{radius: 0.1, colour: red}]', "'colour' is no key here; there are: name, radius"),
    ('movers: [{radius: 5, mode: wander, name: cat}]', 'mover cat: there is no room .* here'),
    ('changes: [{close: [0, 0, 1, 1]}]', 'has none of at_trial, at_time, must have exactly one'),
    ('changes: [{at_time: 1, at_trial: 1, close: [0, 0, 1, 1]}]', 'has at_trial and at_time of'),
    ('changes: [{at_time: 1}]', 'has none of close, open, map'),
    ('changes: [{at_time: -1, open: [0, 0, 1, 1]}]', 'at_time is -1, must be between 0'),
    ('changes: [{at_trial: 0, open: [0, 0, 1, 1]}]', 'at_trial is 0, must be between 1'),
    ('changes: [{at_trial: 1.5, open: [0, 0, 1, 1]}]', 'at_trial is 1.5, must be a whole number'),
    ('changes: [{at_trial: 1, open: [0, 0, 1]}]', 'open is .* must be two corners'),
    ('changes: [{at_trial: 1, open: [0, 0, 0.1, 0.1]}]', 'open: no cell .* make it larger'),
    ('changes: [{at_trial: 1, map: [1]}]', 'map must be the name'),
    ('changes: [{at_trial: 1, map: none.yaml}]', 'there is no such file'),
    ('a: &a [1]\nb: *a', 'has an alias'),
])
def test_what_is_wrong_is_said_in_one_line(read, tmp_path, text, words):
    with pytest.raises(ValueError, match=words) as error:
        read(text)
    assert str(tmp_path) in str(error.value)
    assert '\n' not in str(error.value)


def test_unknown_names_are_answered_with_the_known_ones():
    assert find_movers('a/b.yaml') == Path('a/b.yaml')
    with pytest.raises(ValueError, match='crossing, door'):
        find_movers('nothing')


class TestChanges:
    def test_at_a_time_and_at_a_trial(self, read):
        world = ChangingWorld(WORLD, read("""
changes:
  - {at_time: 10, close: [1.0, 0.0, 1.5, 1.0]}
  - {at_trial: 3, open: [1.0, 0.0, 1.5, 0.5]}
""").changes)
        assert not world.update(9.0, 0)
        (change,) = world.update(10.0, 1)
        assert change.name == '(1, 0) to (1.5, 1) m closes'
        assert np.argwhere(world.world.occupancy).tolist() == [[0, 2], [1, 2]]
        assert len(world.update(11.0, 2)) == 1
        assert np.argwhere(world.world.occupancy).tolist() == [[1, 2]]
        assert not world.update(12.0, 3)
        world.reset()
        assert world.world is WORLD

    def test_another_map_of_the_same_size(self, read, tmp_path):
        cells = np.zeros((4, 6), dtype=np.int8)
        cells[1, 1] = 100
        save_world(tmp_path / 'other.yaml', World(WORLD.grid, cells))
        save_world(tmp_path / 'small.yaml', World(Grid(1, 1, 0.5), cells[:1, :1]))
        world = ChangingWorld(WORLD, read('changes: [{at_trial: 1, map: other.yaml}]').changes)
        world.update(0.0, -1)
        assert not world.world.occupancy.any()
        world.update(0.0, 0)
        assert (world.world.occupancy == cells).all()
        with pytest.raises(ValueError, match='must be as large as the world here, 4 x 6 cells'):
            read('changes: [{at_trial: 1, map: small.yaml}]')

    def test_no_door_closes_on_the_robot(self, read):
        changes = read('changes: [{at_time: 1, close: [0, 0, 3, 0.5]}]').changes
        world, robot = ChangingWorld(WORLD, changes), Disc(1.0, 0.25, 0.1)
        world.update(1.0, 0, robot)
        assert world.world.occupancy[0].tolist() == [100, 0, 0, 100, 100, 100]
        assert not world.update(2.0, 0, robot)
        world.update(3.0, 0, Disc(1.0, 0.75, 0.1))
        assert world.world.occupancy[0].all()
