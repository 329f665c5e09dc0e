"""YAML that is not ours is bounded in memory and time, and what is written is read again."""

import time

from hypothesis import given
from hypothesis import strategies as st
import pytest
import yaml

from msgs_bridge.untrusted.yaml_texts import text_from_yaml, yaml_from_text


def bomb(levels=30):
    lines = ['a0: &a0 [x, x]', *(f'a{i}: &a{i} [*a{i - 1}, *a{i - 1}]' for i in range(1, levels))]
    return '\n'.join(lines) + f'\nmode: *a{levels - 1}\n'


HOSTILE = {
    'aliases': bomb(), 'one alias': 'a: &b c\nd: *b\n', 'itself': '&a [*a]',
    'merge': 'a: {<<: {b: 1}}', 'deep': '[' * 100_000, 'deep maps': '{a: ' * 5000,
    'deep blocks': '\n'.join(' ' * n + 'a:' for n in range(200)), 'many': '[' + '[],' * 600_000,
    'long number': 'a: ' + '1:' * 100_000 + '1', 'digits': 'a: ' + '9' * 100_000,
    'python': '!!python/object/apply:os.getcwd []', 'cut': '{a: [', 'bytes': '\0', 'date':
    'a: 2026-99-99', 'tagged': 'a: !!int "' + '1:' * 100_000 + '1"'}


@pytest.mark.parametrize('kind', HOSTILE)
def test_yaml_is_bounded(kind):
    began = time.process_time()
    with pytest.raises(ValueError, match=r'it |must be|integer string') as caught:
        yaml_from_text(HOSTILE[kind])
    assert time.process_time() - began < 5.0
    assert '\n' not in str(caught.value)
    assert len(str(caught.value)) < 200


def test_yaml_says_where_an_alias_is():
    with pytest.raises(ValueError, match=r'alias \(\*b\) in line 2'):
        yaml_from_text(HOSTILE['one alias'])


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=10)


@given(plain)
def test_yaml_without_such_things_says_what_it_says(value):
    assert yaml_from_text(yaml.safe_dump(value)) == value
    assert yaml_from_text(yaml.safe_dump(value).encode()) == value


@given(plain)
def test_what_is_written_is_read_again_without_aliases(value):
    twice = {'one': value, 'two': value}
    assert yaml_from_text(text_from_yaml(twice)) == twice
    assert list(yaml_from_text(text_from_yaml({'b': value, 'a': 1}))) == ['b', 'a']
