"""Going through a file finds all that is whole in it, and no file makes it stumble."""

from io import BytesIO
import struct
import tracemalloc

from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, IndexType, Writer
import numpy as np
import pytest

from bridge_helpers import refusal
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.mcap_scan import (
    CHUNK_OP, CompressedError, MAGIC, MESSAGE, RECORD, scan, START)
from episode_store.rosbag2.reader import take


def mcap_file(messages, chunk_size=200, **options):
    """Return an MCAP file of (channel, time, bytes)."""
    stream = BytesIO()
    writer = Writer(stream, chunk_size=chunk_size,
                    **{'compression': CompressionType.NONE, **options})
    writer.start('ros2')
    schema = writer.register_schema('a/msg/B', 'ros2msg', b'int32 x')
    channels = [writer.register_channel(f'/t{i}', 'cdr', schema, {'i': str(i)}) for i in range(3)]
    writer.add_metadata('first', {'key': 'wörld'})
    for channel, time, data in messages:
        writer.add_message(channels[channel], time, data, time + 1)
    writer.add_metadata('last', {})
    writer.finish()
    return stream.getvalue()


messages = st.lists(
    st.tuples(st.integers(0, 2), st.integers(0, 2**63), st.binary(max_size=90)), max_size=40)
SAMPLE = mcap_file([(i % 3, i, bytes([i]) * i) for i in range(40)])


def contents(data, found):
    """Return times and bytes of all messages by channel."""
    read = {}
    for number in found.channels:
        read[number] = []
        for at in found.starts.get(number, ()):
            opcode, length = START.unpack_from(data, at)
            of_channel, _, log_time, publish_time = struct.unpack_from('<HIQQ', data, at + RECORD)
            assert (opcode, of_channel) == (5, number)
            read[number].append((log_time, publish_time, data[at + MESSAGE:at + RECORD + length]))
    return read


@given(messages, st.integers(1, 500), st.booleans(), st.booleans())
def test_what_was_written_is_found(messages, chunk_size, use_chunking, verify):
    data = mcap_file(messages, chunk_size, use_chunking=use_chunking)
    found = scan(memoryview(data), verify)
    wanted = {number: [(time, time + 1, raw) for channel, time, raw in messages
                       if channel + 1 == number] for number in (1, 2, 3)}
    if messages or not use_chunking:
        assert contents(data, found) == wanted
        assert found.channels[1].schema == ('a/msg/B', 'ros2msg', b'int32 x')
        assert found.channels[2].metadata == {'i': '1'}
    assert found.metadata == [('first', {'key': 'wörld'}), ('last', {})]
    assert found.complete
    assert found.damage == ''


@pytest.mark.parametrize('options', [
    {'index_types': IndexType.NONE}, {'use_statistics': False},
    {'repeat_channels': False, 'repeat_schemas': False}, {'use_summary_offsets': False},
    {'enable_crcs': False}, {'index_types': IndexType.CHUNK}], ids=str)
def test_files_of_other_writers(options):
    sent = [(i % 3, i, bytes(i)) for i in range(40)]
    found = scan(memoryview(mcap_file(sent, **options)))
    assert found.complete
    assert sum(map(len, found.starts.values())) == 40


@pytest.mark.parametrize('kind', [CompressionType.LZ4, CompressionType.ZSTD])
def test_compressed_chunks_are_left_to_others(kind):
    data = memoryview(mcap_file([(0, 1, b'x')], compression=kind))
    with pytest.raises(CompressedError, match=f'compressed with {kind.name.lower()}'):
        scan(data)


@pytest.mark.parametrize('data', [b'x', b'SQLite format 3\0', b'\x89MCAP0\r\x00', b'#ROSBAG V2.0'])
def test_what_is_no_mcap_file(data):
    with pytest.raises(BagError, match='it is no MCAP file'):
        scan(memoryview(data))


@given(st.integers(0, len(SAMPLE) - 1))
def test_a_cut_file_gives_all_that_is_before_the_cut(cut):
    data, sample = SAMPLE[:cut], scan(memoryview(SAMPLE))
    found = scan(memoryview(data))
    assert found.damage
    kept, is_whole = contents(data, found), True
    for number, sent in contents(SAMPLE, sample).items():
        before = [message for at, message in zip(sample.starts[number].tolist(), sent, strict=True)
                  if at + MESSAGE + len(message[2]) <= cut]
        assert kept.get(number, []) == before
        is_whole &= before == sent
    # A file may be cut right behind its last message: nobody can tell that it was the last.
    assert is_whole or not found.complete


def test_a_chunk_that_does_not_match_its_checksum_is_left_out():
    starts = scan(memoryview(SAMPLE)).starts[3]
    spoilt = bytearray(SAMPLE)
    spoilt[int(starts[-1]) + MESSAGE] ^= 1
    found = scan(memoryview(spoilt), verify=True)
    assert 'does not match its checksum' in found.damage
    assert not found.complete
    assert found.n_lost > 30
    assert sum(map(len, found.starts.values())) < 40


def chunk_starts(data):
    at, found = len(MAGIC), []
    while data[at] != 0x0F:
        opcode, length = START.unpack_from(data, at)
        found += [at] if opcode == CHUNK_OP else []
        at += RECORD + length
    return found


@pytest.mark.parametrize('n_places', [1, 3])
@pytest.mark.parametrize('place', [0, 1, 8, 9 + 28, 9 + 34])
def test_behind_a_record_that_was_hit_a_closed_file_is_read_on(place, n_places):
    """Only the chunks are lost whose own opcode, length or head, or that of whose records, was."""
    data, starts = bytearray(SAMPLE), chunk_starts(SAMPLE)
    for start in starts[2:2 + n_places]:
        data[start + place] ^= 0x40
    found = scan(memoryview(data))
    kept, sent = contents(bytes(data), found), contents(SAMPLE, scan(memoryview(SAMPLE)))
    lost = sum(map(len, sent.values())) - sum(map(len, kept.values()))
    # Where no more than the length of the record was hit, its messages are there all the same.
    assert (lost > 0) == (place != 8)
    assert lost < 10 * n_places
    assert all(message in sent[number] for number, read in kept.items() for message in read)
    assert found.damage
    assert not found.complete
    assert 0 < found.n_lost < 500 * n_places


def record(opcode, content):
    return struct.pack('<BQ', opcode, len(content)) + content


def chunk(records):
    return record(6, struct.pack('<QQQII', 0, 0, len(records), 0, 0)
                  + struct.pack('<Q', len(records)) + records)


def test_records_that_another_program_added_are_skipped():
    place, more = chunk_starts(SAMPLE)[2], record(0x80, b'private') + record(0xFF, b'')
    data = bytearray(SAMPLE[:place] + more + SAMPLE[place:])
    # The index is farther behind, and has no checksum.
    index, offsets, _, end = struct.unpack_from('<QQI8s', data, len(data) - 28)
    struct.pack_into('<QQI8s', data, len(data) - 28, index + len(more), offsets, 0, end)
    found, sent = scan(memoryview(data)), scan(memoryview(SAMPLE))
    assert found.complete
    assert found.damage == ''
    assert {number: len(starts) for number, starts in found.starts.items()} == {
        number: len(starts) for number, starts in sent.starts.items()}


def test_chunks_in_chunks_go_no_deeper():
    data = b''
    for _ in range(3000):
        data = chunk(data)
        if len(data) > 200_000:
            break
    found = scan(memoryview(MAGIC + data))
    assert 'cut or makes no sense' in found.damage


@pytest.mark.parametrize('claim', [2**32 - 1, 2**62, 2**64 - 1])
@pytest.mark.parametrize('opcode', [1, 3, 4, 5, 6, 7, 12])
def test_claims_of_great_sizes_cost_no_memory(opcode, claim):
    tracemalloc.start()
    found = scan(memoryview(MAGIC + struct.pack('<BQ', opcode, claim) + bytes(100)))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.damage
    assert peak < 100_000


def test_a_file_of_nothing_but_metadata_has_a_bound():
    one = record(12, struct.pack('<II', 0, 0))
    assert len(scan(memoryview(MAGIC + 10_000 * one)).metadata) == 10_000
    with pytest.raises(BagError, match='more than 10000 metadata records'):
        scan(memoryview(MAGIC + 10_001 * one))


@settings(max_examples=500)
@given(st.lists(st.tuples(st.integers(0, len(SAMPLE) - 1), st.integers(0, 255)), max_size=6),
       st.integers(len(SAMPLE) // 2, len(SAMPLE)))
def test_spoilt_bytes_never_break_the_reader(changes, cut):
    """Whatever the bytes: messages lie within the file and do not overlap, or it is refused."""
    data = bytearray(SAMPLE)
    for at, value in changes:
        data[at] = value
    raw = bytes(data[:cut])
    if refusal(lambda: scan(memoryview(raw)), BagError):
        return
    found = scan(memoryview(raw))
    everywhere = np.sort(np.concatenate([[len(raw)], *found.starts.values()]))
    lengths = [START.unpack_from(raw, int(start))[1] for start in everywhere[:-1]]
    assert (everywhere[:-1] + RECORD + lengths <= everywhere[1:]).all()


@settings(max_examples=300)
@given(st.binary(max_size=400))
def test_any_bytes_after_the_magic(data):
    scan(memoryview(MAGIC + data))
    scan(memoryview(MAGIC + data + MAGIC))


def test_take_copies_windows():
    buffer = np.arange(10, dtype=np.uint8)
    assert take(buffer, np.array([0, 7, 3]), 3).tolist() == [[0, 1, 2], [7, 8, 9], [3, 4, 5]]
    assert take(buffer, np.array([10]), 0).shape == (1, 0)
    assert take(buffer, np.zeros(0, dtype=np.int64), 4).shape == (0, 4)
