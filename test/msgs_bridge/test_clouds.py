"""NumPy tables as PointCloud2, and messages that lie about themselves."""

import array
import tracemalloc

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField

from bridge_helpers import refusal, spoil
from msgs_bridge.messages.clouds import cloud_from_table, table_from_cloud, TableError

SCALARS = ['i1', 'u1', '<i2', '<u2', '<i4', '<u4', '<f4', '<f8']
DTYPE = np.dtype([('x', '<f4'), ('kind', 'u1'), ('q', '<f4', (3,)), ('stamp', '<f8')], align=True)
FAR = 2**32 - 1


@st.composite
def tables(draw):
    n_columns = draw(st.integers(1, 5))
    columns = [(f'c{i}', draw(st.sampled_from(SCALARS)), (draw(st.integers(1, 3)),))
               for i in range(n_columns)]
    dtype = np.dtype(columns, align=draw(st.booleans()))
    shape = draw(st.tuples(st.integers(0, 4), st.integers(0, 4)))
    table = np.zeros(shape, dtype=dtype)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    for name in dtype.names:
        table[name] = rng.integers(0, 100, table[name].shape)
    return table


def example(n=4):
    table = np.zeros(n, dtype=DTYPE)
    table['x'], table['stamp'] = np.arange(n), np.arange(n) * 1e9
    table['q'] = np.arange(3 * n).reshape(n, 3)
    return table


@given(tables())
def test_round_trip(table):
    msg = cloud_from_table(table, 'odom')
    assert (msg.height, msg.width) == table.shape
    assert (msg.header.stamp.sec, msg.header.stamp.nanosec) == (0, 0)
    read = table_from_cloud(msg, table.dtype)
    assert read.dtype == table.dtype
    if table.size:
        np.testing.assert_array_equal(read, table)
    assert read.size == table.size


@given(tables(), st.data())
def test_columns_may_be_chosen_and_come_in_any_order(table, data):
    msg = cloud_from_table(table, 'odom')
    msg.fields = data.draw(st.permutations(msg.fields))
    name = data.draw(st.sampled_from(table.dtype.names))
    read = table_from_cloud(msg, np.dtype([(name, table.dtype[name])]))
    assert read[name].tobytes() == table[name].tobytes()


def test_the_other_byte_order_and_padded_rows_are_read():
    table = example()
    msg = cloud_from_table(table.reshape(2, 2), 'odom')
    swapped = table.astype(DTYPE.newbyteorder('>'))
    rows = [swapped[:2].tobytes() + b'pad', swapped[2:].tobytes() + b'pad']
    msg.data = array.array('B', b''.join(rows))
    msg.row_step += 3
    msg.is_bigendian = True
    np.testing.assert_array_equal(table_from_cloud(msg, DTYPE), table.reshape(2, 2))


@pytest.mark.parametrize(('name', 'value', 'sentence'), [
    ('width', 5, 'row_step is 128, must be 5 points of 32 bytes or more'),
    ('width', FAR, f'must be {FAR} points of 32 bytes'),
    ('height', FAR, f'128 bytes of data, must be {FAR} rows of 128'),
    ('height', 0, '128 bytes of data, must be 0 rows of 128'),
    ('point_step', 0, 'point_step is 0, must be 1 or more'),
    ('point_step', FAR, f'must be 4 points of {FAR} bytes'),
    ('point_step', 31, 'column stamp ends at byte 32, must end within the point of 31'),
    ('row_step', FAR, f'must be 1 rows of {FAR}'),
    ('row_step', 0, 'row_step is 0'),
    ('data', array.array('B', bytes(127)), '127 bytes of data, must be 1 rows of 128'),
    ('fields', [], 'column x stands 0 times'),
])
def test_sizes_that_lie(name, value, sentence):
    msg = cloud_from_table(example(), 'odom')
    spoil(msg, name, value)
    with pytest.raises(TableError, match=sentence):
        table_from_cloud(msg, DTYPE)


@pytest.mark.parametrize(('name', 'value', 'sentence'), [
    ('name', 'y', 'column kind stands 0 times, must once, among: x, y, q, stamp'),
    ('name', 'x', 'column x stands 2 times'),
    ('datatype', PointField.INT8, r'column kind has datatype 1, must be 2 \(uint8\)'),
    ('datatype', 99, 'column kind has datatype 99'),
    ('count', 0, 'column kind has count 0, must be 1'),
    ('count', FAR, f'column kind has count {FAR}'),
    ('offset', FAR, f'column kind ends at byte {FAR + 1}'),
    ('offset', 32, 'column kind ends at byte 33'),
    ('offset', 3, 'columns x and kind overlap at byte 3'),
])
def test_columns_that_lie(name, value, sentence):
    msg = cloud_from_table(example(), 'odom')
    setattr(msg.fields[1], name, value)
    with pytest.raises(TableError, match=sentence):
        table_from_cloud(msg, DTYPE)


numbers = st.integers(0, 2**32 - 1) | st.integers(0, 40)
lying_fields = st.builds(
    lambda name, offset, datatype, count: PointField(
        name=name, offset=offset, datatype=datatype, count=count),
    st.sampled_from(['x', 'kind', 'q', 'stamp', 'else']), numbers, st.integers(0, 255), numbers)
honest_fields = st.sampled_from(cloud_from_table(example(), 'odom').fields)


@given(numbers, numbers, numbers, numbers, st.booleans(), st.binary(max_size=300),
       st.lists(lying_fields | honest_fields, max_size=6))
def test_nothing_but_a_table_error_and_no_memory(
        height, width, point_step, row_step, is_bigendian, data, fields):
    msg = PointCloud2(height=height, width=width, point_step=point_step, row_step=row_step,
                      is_bigendian=is_bigendian, data=array.array('B', data), fields=fields)
    tracemalloc.start()
    sentence = refusal(lambda: table_from_cloud(msg, DTYPE), TableError)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert '\n' not in sentence
    assert peak < 1_000_000


@pytest.mark.parametrize('dtype', [[('x', '<i8')], [('x', '<f4', (2, 2))], [('x', 'S3')]])
def test_a_column_that_a_cloud_has_not_is_not_written(dtype):
    with pytest.raises(TableError, match='column x is of type'):
        cloud_from_table(np.zeros(1, dtype=dtype), 'odom')


def test_names_of_others_cannot_break_lines_nor_fill_a_log():
    fields = [PointField(name='a\nb' + 'c' * 9999, datatype=7, count=1) for _ in range(99)]
    msg = PointCloud2(fields=fields)
    sentence = refusal(lambda: table_from_cloud(msg, DTYPE), TableError)
    assert '\n' not in sentence
    assert len(sentence) < 1000
