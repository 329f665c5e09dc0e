"""Big frames: what is put in comes out, as the page's own reader would read it."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from frame_helpers import frame_from_bytes
from page_node.big_frames import bytes_from_frame, TYPES


@given(text=st.text(max_size=9), types=st.lists(st.sampled_from(sorted(TYPES)), max_size=4),
       shape=st.lists(st.integers(0, 3), min_size=1, max_size=2))
def test_what_is_put_in_comes_out(text, types, shape):
    rng = np.random.default_rng(0)
    arrays = {f'a{i}': rng.integers(0, 100, shape).astype(kind) for i, kind in enumerate(types)}
    data = bytes_from_frame({'type': 'field', 'text': text}, arrays)
    header, found = frame_from_bytes(data)
    assert header == {'type': 'field', 'text': text}
    assert int.from_bytes(data[:4], 'little') % 4 == 0
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


def test_a_type_that_the_page_does_not_know_is_refused():
    with pytest.raises(ValueError, match='stamps is of type float64'):
        bytes_from_frame({'type': 'replay'}, {'stamps': np.zeros(3)})
    with pytest.raises(ValueError, match='JSON'):
        bytes_from_frame({'type': 'replay', 'seconds': float('nan')}, {})
