"""The scripted driver: it gets there, and keeps to the line."""

from itertools import pairwise
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from control_field.grid import Grid
from experience_cli.demo.path_follower import cells_along, Driver, NEAR, points_from_cells
from experience_cli.demo.show_and_try import WAY

TICK = 0.05


def drive(points, yaw=0.0, speed=0.2):
    """Drive a perfect robot; return its positions."""
    driver = Driver(points, speed)
    x, y = points[0]
    path = [(x, y)]
    while (command := driver.command(x, y, yaw)) is not None:
        v, w = command
        assert abs(v) <= speed
        x, y, yaw = (x + v * TICK * math.cos(yaw), y + v * TICK * math.sin(yaw), yaw + w * TICK)
        path.append((x, y))
        assert len(path) < 10_000, 'the driver does not arrive'
    return path


def off_line(point, points):
    """Return how far a point is from a line of points."""
    best = math.inf
    for (ax, ay), (bx, by) in pairwise(points):
        length = math.hypot(bx - ax, by - ay)
        share = ((point[0] - ax) * (bx - ax) + (point[1] - ay) * (by - ay)) / length ** 2
        share = min(max(share, 0.0), 1.0)
        best = min(best, math.dist(point, (ax + share * (bx - ax), ay + share * (by - ay))))
    return best


def test_it_follows_the_way_of_the_demo():
    grid = Grid(20, 20, 0.25)
    points = points_from_cells(grid, ((3, 2), (3, 15), (16, 15)))
    path = drive(points)
    assert math.dist(path[-1], points[-1]) < 3 * NEAR
    assert max(off_line(point, points) for point in path) < grid.resolution / 3
    cells = {grid.cell_from_world(*point) for point in path}
    assert {(3, col) for col in range(2, 15)} | {(row, 15) for row in range(5, 17)} <= cells


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi), st.floats(0.5, 5.0))
def test_it_arrives_whichever_way_it_looks(yaw, heading, length):
    end = (length * math.cos(heading), length * math.sin(heading))
    path = drive([(0.0, 0.0), end], yaw)
    assert math.dist(path[-1], end) < 0.1


def test_it_does_not_command_at_the_end():
    driver = Driver([(0.0, 0.0), (1.0, 0.0)])
    assert driver.command(1.0, 0.0, 0.0) is None
    assert driver.travelled == pytest.approx(driver.length)


def test_the_paper_s_way_is_one_cell_after_the_other():
    cells = cells_along(WAY)
    assert [cells[0], cells[-1], len(cells)] == [WAY[0], WAY[-1], 27]
    assert set(WAY) <= set(cells)
    assert all(max(abs(b[0] - a[0]), abs(b[1] - a[1])) == 1 for a, b in pairwise(cells))
