"""Markers for RViz."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from bridge_helpers import grids, random_field, random_prototypes
from control_field.grid import Grid
from msgs_bridge.messages.markers import markers_from_field, MAX_ARROWS


@given(grids, st.integers(0, 2**32))
def test_one_list_of_lines_and_one_of_spheres(grid, seed):
    field, prototypes = random_field(grid, seed), random_prototypes(grid, seed)
    msg = markers_from_field(field, prototypes)
    arrows, spheres = deserialize_message(serialize_message(msg), MarkerArray).markers
    assert (arrows.type, spheres.type) == (Marker.LINE_LIST, Marker.SPHERE_LIST)
    n_arrows = int(((field.vx != 0) | (field.vy != 0)).sum())
    assert len(arrows.points) == len(arrows.colors) == 6 * n_arrows
    assert len(spheres.points) == len(spheres.colors) == len(prototypes)
    for marker, n in ((arrows, n_arrows), (spheres, len(prototypes))):
        assert marker.action == (Marker.ADD if n else Marker.DELETE)
        assert marker.header.frame_id == grid.frame_id


@given(grids, st.integers(0, 2**32))
def test_arrows_start_and_end_in_their_cell_along_the_course(grid, seed):
    field = random_field(grid, seed)
    arrows = markers_from_field(field, random_prototypes(grid, seed)).markers[0]
    points = np.array([(point.x, point.y) for point in arrows.points]).reshape(-1, 6, 2)
    cells = np.argwhere((field.vx != 0) | (field.vy != 0))
    middle = (points[:, 0] + points[:, 1]) / 2
    np.testing.assert_allclose(middle, grid.world_from_cells(cells), atol=1e-6 * grid.resolution)
    headings = np.stack([field.vx, field.vy], axis=-1)[tuple(cells.T)]
    np.testing.assert_allclose((points[:, 1] - points[:, 0]) / (0.8 * grid.resolution), headings,
                               atol=1e-6)


def test_a_great_field_is_thinned_out():
    grid = Grid(200, 300, 0.1)
    markers = markers_from_field(random_field(grid, 1), random_prototypes(grid, 1)).markers
    assert 0 < len(markers[0].points) <= 6 * MAX_ARROWS


def test_red_is_little_and_green_is_much():
    grid = Grid(1, 2, 1.0)
    field = random_field(grid, 0)
    field = type(field)(grid, 0, (0, 0), np.ones((1, 2), np.float32), np.zeros((1, 2), np.float32),
                        np.array([[0, 1]], np.float32), field.q, field.known, field.flags)
    low, high = markers_from_field(field, random_prototypes(grid, 0)).markers[0].colors[::6]
    assert low.r > low.g
    assert high.g > high.r
