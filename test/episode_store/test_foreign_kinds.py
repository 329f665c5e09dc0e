"""A drive of each kind of bag of others, with the defaults alone: right, or refused and why."""

import pytest

from benchmarks.foreign_drives import is_as_it_must_be, judged, KINDS


@pytest.mark.parametrize('name', KINDS)
def test_it_is_learnt_right_or_refused_with_what_to_do(name):
    result = judged(name, 1)
    assert is_as_it_must_be(name, result), result
