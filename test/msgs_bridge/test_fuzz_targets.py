"""Spoilt bytes into every decoder and reader; `python -m benchmarks.fuzz` looks longer."""

import tracemalloc

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from benchmarks.fuzz_targets import targets

TARGETS = targets()
LIMIT = 5_000_000


@st.composite
def spoilt(draw, seed):
    """Return bytes with some overwritten, cut, or said twice."""
    data = bytearray(seed)
    for _ in range(draw(st.integers(1, 6))):
        at = draw(st.integers(0, len(data) - 1))
        data[at] = draw(st.sampled_from([0, 1, 127, 128, 255]) | st.integers(0, 255))
    first, last = sorted(draw(st.integers(0, len(data))) for _ in range(2))
    return bytes(draw(st.sampled_from([data, data[:last], data + data[first:last]])))


@pytest.mark.parametrize('name', TARGETS)
def test_the_seeds_are_accepted(name):
    assert all(TARGETS[name](seed) for seed in TARGETS[name].seeds)


@pytest.mark.parametrize('name', TARGETS)
@settings(max_examples=60)
@given(data=st.data())
def test_spoilt_bytes_are_read_or_refused_in_a_line(name, data):
    target = TARGETS[name]
    raw = data.draw(spoilt(data.draw(st.sampled_from(target.seeds))))
    tracemalloc.start()
    target(raw)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < LIMIT
