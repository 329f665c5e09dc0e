"""What arrives as numbers and arrays for a browser."""

import math
from types import SimpleNamespace

import numpy as np

from control_field.grid import Grid
from control_field.headings import UNIT
from control_field.records import CellFlag, ControlField, Prototypes
from msgs_bridge.messages.poses import Pose
from page_node.field_frames import field_frame, HEADING, HOME, prototypes_frame
from page_node.view.frames import local_grid_frame, movers_frame, robot_frame, truth_frame

GRID = Grid(6, 9, 0.25, -1.0, 2.0, 'odom')


def field_of(headings, known, goal=(0, 0)):
    """Return a field of headings, -1 for none, on a map."""
    shape = headings.shape
    vectors = np.where((headings >= 0)[..., np.newaxis], UNIT[headings], 0.0).astype(np.float32)
    grid = Grid(*shape, 0.25, -1.0, 2.0, 'odom')
    return ControlField(
        grid, 3, goal, vectors[..., 0], vectors[..., 1], np.ones(shape, dtype=np.float32),
        np.zeros((*shape, 8), dtype=np.float32), known, np.zeros(shape, dtype=np.uint8))


def test_a_field_has_angles_flags_and_what_is_known():
    headings = np.full(GRID.shape, -1)
    headings[0] = 4
    headings[2, 3] = 2
    known = np.zeros(GRID.shape, dtype=np.int8)
    known[1, 3] = 100
    content, arrays = field_frame(field_of(headings, known))
    assert content == {'rows': 6, 'cols': 9, 'resolution': 0.25, 'origin': [-1.0, 2.0],
                       'frame': 'odom', 'revision': 3}
    assert {name: array.dtype.str[1:] for name, array in arrays.items()} == {
        'angle': 'u1', 'flags': 'u1', 'known': 'i1'}
    assert arrays['angle'][0, 1] == 128
    assert arrays['angle'][2, 3] == 64
    assert arrays['flags'][0, 0] == CellFlag.GOAL | HOME | HEADING
    assert arrays['flags'][0, 8] == HOME | HEADING
    assert arrays['flags'][2, 3] == HEADING
    assert arrays['flags'][4, 4] == 0


def test_a_field_of_nothing_has_no_goal():
    content, arrays = field_frame(ControlField.void(GRID))
    assert content['revision'] == 0
    assert not arrays['flags'].any()


def test_prototypes_lie_at_the_centres_of_their_cells():
    prototypes = Prototypes(
        np.array([[0, 1], [2, 3]], dtype=np.int32), np.array([1, 7], dtype=np.int8),
        np.array([0.5, 1.0]), np.array([1, 2], dtype=np.int32), np.array([0.0, math.nan]),
        np.array([True, False]))
    _, arrays = prototypes_frame(prototypes, GRID)
    assert arrays['x'].tolist() == [-0.625, -0.125]
    assert arrays['y'].tolist() == [2.125, 2.625]
    assert arrays['demonstrated'].tolist() == [1, 0]
    assert {name: array.dtype.str[1:] for name, array in arrays.items()} == {
        'x': 'f4', 'y': 'f4', 'q': 'f4', 'heading': 'i1', 'demonstrated': 'u1'}


def test_robot_local_grid_and_map():
    frame = robot_frame(Pose(1.23456, 0.123456, 2.0, 0.5, 0.1, -0.2), 0.1)
    assert frame == {'stamp': 1.235, 'x': 0.1235, 'y': 2.0, 'yaw': 0.5, 'v': 0.1, 'w': -0.2,
                     'radius': 0.1}
    cells = np.array([[0, 100, -1]], dtype=np.int8)
    local = Grid(1, 3, 0.25, -1.0, 2.0, 'odom')
    assert local_grid_frame(local, cells) == {
        'rows': 1, 'cols': 3, 'resolution': 0.25, 'x0': -1.0, 'y0': 2.0, 'cells': [0, 100, -1]}
    content, arrays = truth_frame(local, cells)
    assert content['origin'] == [-1.0, 2.0]
    assert arrays['occupancy'] is cells


def marker(x, action=0, width=0.6):
    return SimpleNamespace(action=action, ADD=0, scale=SimpleNamespace(x=width),
                           pose=SimpleNamespace(position=SimpleNamespace(x=x, y=1.0)))


def test_movers_are_discs_and_what_is_none_is_left_out():
    markers = [marker(2.0), marker(3.0, action=2), marker(math.nan), marker(4.0, width=math.inf)]
    assert movers_frame(markers) == {'discs': [[2.0, 1.0, 0.3]]}
    assert len(movers_frame([marker(1.0)] * 10_000)['discs']) == 500
