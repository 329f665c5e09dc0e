"""Texts of one kind, and that none is said for ever."""

from msgs_bridge.node.kinds_of_text import kind_of, SaidOnce


def test_numbers_and_what_is_quoted_do_not_make_another_kind():
    assert kind_of("odom: frame is 'a' at 1.5") == kind_of("odom: frame is 'bc' at -3e9")
    assert kind_of('odom: x is nan') != kind_of('odom: y is nan')


def test_what_is_told_apart_is_limited():
    said = SaidOnce(limit=5)
    texts = [f'kind {chr(97 + k)}' for k in range(20)]
    assert [said.is_new(text) for text in texts] == [True] * 5 + [False] * 15
    assert not said.is_new(texts[0])
