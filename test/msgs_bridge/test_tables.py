"""The three tables: round trips, equal bytes, and values that cannot be."""

from functools import partial

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2

from bridge_helpers import grids, random_decisions, random_field, random_prototypes, refusal
from control_field.grid import Grid
from msgs_bridge.messages.clouds import cloud_from_table, TableError
from msgs_bridge.messages.tables import (
    cloud_from_decisions, cloud_from_field, cloud_from_prototypes, decisions_from_cloud,
    EXPERIENCE_DTYPE, FIELD_DTYPE, field_from_cloud, PROTOTYPE_DTYPE, prototypes_from_cloud)

GRID = Grid(4, 5, 0.25, -1.0, 2.0)
COLUMNS = ('vx', 'vy', 'coherence', 'q', 'known', 'flags')
seeds = st.integers(0, 2**32)


def over_the_wire(msg):
    return deserialize_message(serialize_message(msg), PointCloud2)


@given(grids, seeds)
def test_field_round_trip(grid, seed):
    field = random_field(grid, seed)
    read = field_from_cloud(over_the_wire(cloud_from_field(field)))
    assert (read.grid, read.revision, read.goal) == (grid, field.revision, field.goal)
    for name in COLUMNS:
        assert getattr(read, name).tobytes() == getattr(field, name).tobytes(), name


@given(grids, seeds)
def test_equal_fields_give_equal_bytes(grid, seed):
    first, second = (cloud_from_field(random_field(grid, seed)) for _ in range(2))
    assert first == second
    assert first.data.tobytes() == second.data.tobytes()


@given(grids, seeds)
def test_prototypes_round_trip(grid, seed):
    prototypes = random_prototypes(grid, seed)
    read = prototypes_from_cloud(over_the_wire(cloud_from_prototypes(prototypes, grid)))
    for name in ('cells', 'headings', 'q', 'episodes', 'stamps', 'demonstrated'):
        np.testing.assert_array_equal(getattr(read, name), getattr(prototypes, name))
        assert getattr(read, name).dtype == getattr(prototypes, name).dtype


@given(grids, st.integers(0, 9), seeds)
def test_decisions_round_trip(grid, n, seed):
    decisions = random_decisions(grid, n, seed)
    read = decisions_from_cloud(over_the_wire(cloud_from_decisions(decisions, grid)), grid)
    np.testing.assert_array_equal(read, decisions)


def test_points_lie_where_their_cells_are():
    msg = cloud_from_field(random_field(GRID, 0))
    table = np.frombuffer(msg.data, FIELD_DTYPE).reshape(GRID.shape)
    assert (table['x'][2, 3], table['y'][2, 3]) == GRID.world_from_cell(2, 3)
    assert msg.header.frame_id == 'odom'


def test_the_goal_is_told_by_its_flag_alone():
    field = random_field(GRID, 1)
    flags = field.flags.copy()
    flags[:] = 4
    read = field_from_cloud(cloud_from_field(
        type(field)(field.grid, field.revision, field.goal, field.vx, field.vy, field.coherence,
                    field.q, field.known, flags)))
    assert read.goal == field.goal
    assert (read.flags & 4).sum() == 4


def altered(table, column, value, place=(1, 2)):
    """Return a cloud of a table with one value changed."""
    table = table.copy()
    table[column][place] = value
    return cloud_from_table(table, 'odom')


@pytest.mark.parametrize(('column', 'value', 'sentence'), [
    ('vx', np.nan, r'vx is nan at \(1, 2\), must be finite'),
    ('q', np.inf, r'q is inf at \(1, 2, 0\), must be finite'),
    ('vy', -np.inf, 'vy is -inf'),
    ('vx', 7.0, r'length of \(vx, vy\) is 7.* must be 0 or 1'),
    ('coherence', 1.5, 'coherence is 1.5 .* must be 0 to 1'),
    ('known', 101, 'known is 101 .* must be -1 to 100'),
    ('known', -2, 'known is -2 .* must be -1 to 100'),
    ('flags', 16, 'flags is 16 .* must be below 16'),
    ('flags', 4, '2 cells hold the flag GOAL, must be 1'),
    ('version', 2, 'version is 2 .* must be 1'),
    ('revision', 0, 'revision is 0 .* everywhere'),
    ('resolution', 0.5, 'resolution is 0.5 .* must be 0.25 everywhere'),
    ('origin_x', np.nan, 'origin_x is nan'),
    ('x', 0.0, 'x is 0.0 .* must be the centre of its cell'),
    ('y', np.nan, 'y is nan .* must be the centre of its cell'),
])
def test_values_that_no_field_has(column, value, sentence):
    msg = cloud_from_field(random_field(GRID, 2))
    table = np.frombuffer(msg.data, FIELD_DTYPE).reshape(GRID.shape).copy()
    table['flags'] = 0
    table['flags'][0, 0] = 4
    table['vx'], table['vy'] = 1.0, 0.0
    with pytest.raises(TableError, match=f'control_field: .*{sentence}'):
        field_from_cloud(altered(table, column, value))


@pytest.mark.parametrize('value', [0.0, -1.0, np.nan, np.inf])
def test_a_grid_that_is_none(value):
    msg = cloud_from_field(random_field(GRID, 2))
    table = np.frombuffer(msg.data, FIELD_DTYPE).reshape(GRID.shape).copy()
    table['resolution'] = value
    with pytest.raises(TableError, match=r'control_field: .*resolution'):
        field_from_cloud(cloud_from_table(table, 'odom'))


def test_a_field_without_goal_or_cells():
    table = np.zeros((0, 0), dtype=FIELD_DTYPE)
    with pytest.raises(TableError, match='it has no cells'):
        field_from_cloud(cloud_from_table(table, 'odom'))
    msg = cloud_from_field(random_field(GRID, 2))
    table = np.frombuffer(msg.data, FIELD_DTYPE).reshape(GRID.shape).copy()
    table['flags'] = 0
    with pytest.raises(TableError, match='0 cells hold the flag GOAL'):
        field_from_cloud(cloud_from_table(table, 'odom'))


def test_another_version_is_named_even_if_its_columns_differ():
    table = np.zeros(3, dtype=[('version', 'u1'), ('else', '<f4')])
    table['version'] = 2
    with pytest.raises(TableError, match='version is 2'):
        field_from_cloud(cloud_from_table(table, 'odom'))


@pytest.mark.parametrize('read', [field_from_cloud, prototypes_from_cloud, decisions_from_cloud])
def test_missing_columns_are_named(read):
    table = np.ones(3, dtype=[('version', 'u1')])
    with pytest.raises(TableError, match='column x stands 0 times'):
        read(cloud_from_table(table, 'odom'))
    with pytest.raises(TableError, match='column version stands 0 times'):
        read(PointCloud2(point_step=1))


@given(seeds)
def test_more_columns_than_needed_are_passed_over(seed):
    decisions = random_decisions(GRID, 3, seed)
    plain = np.frombuffer(cloud_from_decisions(decisions, GRID).data, EXPERIENCE_DTYPE)
    more = np.zeros(3, dtype=[('note', '<f8'), *EXPERIENCE_DTYPE.descr, ('end', 'u1')])
    for name in EXPERIENCE_DTYPE.names:
        more[name] = plain[name]
    more = np.asarray(more[['note', *EXPERIENCE_DTYPE.names, 'end']])
    np.testing.assert_array_equal(
        decisions_from_cloud(cloud_from_table(more, 'odom'), GRID), decisions)


@pytest.mark.parametrize(('column', 'value', 'sentence'), [
    ('heading', 8, 'heading is 8 .* must be one of 0, 1,'),
    ('heading', -1, 'heading is -1'),
    ('demonstrated', 2, 'demonstrated is 2 .* must be one of 0, 1'),
    ('q', np.nan, 'q is nan .* must be finite'),
    ('stamp', np.inf, 'stamp is inf .* must be seconds or NaN'),
    ('row', -1, 'row is -1 .* must be 0 to 99999'),
    ('col', 100_000, 'col is 100000'),
    ('col', 0, r'cell \(0, 0\) must come once, ordered by row, then column'),
])
def test_values_that_no_prototype_has(column, value, sentence):
    table = np.zeros(3, dtype=PROTOTYPE_DTYPE)
    table['version'], table['col'] = 1, np.arange(3)
    with pytest.raises(TableError, match=f'prototypes: .*{sentence}'):
        prototypes_from_cloud(altered(table, column, value, 2))


@pytest.mark.parametrize(('column', 'value', 'sentence'), [
    ('action', 8, 'action is 8 at .* must be one of 0, 1'),
    ('action', -1, 'action is -1'),
    ('reward', 2, 'reward is 2 .* must be one of -1, 0, 1'),
    ('kind', 99, 'kind is 99 .* must be one of 0, 1, 2, 3, 4'),
    ('stamp', np.nan, 'stamp is nan .* must be seconds'),
    ('stamp', -1.0, 'stamp is -1.0'),
    ('row', 4, 'row is 4 at .* must be 0 to 3'),
    ('next_col', -1, 'next_col is -1 .* must be 0 to 4'),
    ('next_row', 3, r'the step from \(0, 0\) leads to \(3, 0\), must lead to a neighbour'),
    ('version', 0, 'version is 0'),
])
def test_values_that_no_decision_has(column, value, sentence):
    table = np.zeros(3, dtype=EXPERIENCE_DTYPE)
    table['version'] = 1
    with pytest.raises(TableError, match=f'experience: .*{sentence}'):
        decisions_from_cloud(altered(table, column, value, 1), GRID)


def test_decisions_of_another_frame_are_refused():
    msg = cloud_from_decisions(random_decisions(GRID, 1, 0), GRID)
    msg.header.frame_id = 'map'
    assert len(decisions_from_cloud(msg)) == 1
    with pytest.raises(TableError, match="experience: frame is 'map', must be 'odom'"):
        decisions_from_cloud(msg, GRID)


@given(seeds, st.data())
def test_spoilt_bytes_give_a_table_or_a_table_error(seed, data):
    raw = bytearray(serialize_message(cloud_from_field(random_field(GRID, seed))))
    # The sizes and columns stand in the first bytes; only there does a message lie about itself.
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(16, 600) | st.integers(16, len(raw) - 1))
        raw[at] = data.draw(st.integers(0, 255))
    try:
        msg = deserialize_message(bytes(raw), PointCloud2)
    except Exception:  # the middleware refuses what is no message at all
        return
    for read in (field_from_cloud, prototypes_from_cloud, decisions_from_cloud):
        assert '\n' not in refusal(partial(read, msg), TableError)
