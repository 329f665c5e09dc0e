"""What is written about the code is held to the code."""

import xml.etree.ElementTree as ET

import pytest

from tools import architecture, documents

GLOSSARY = f'{documents.REPLACED}\n| old | say |\n|---|---|\n| `sight`, `gaze` | local grid |\n'


@pytest.mark.parametrize('name', [
    'control_field/grid.py', 'control_field/grid.py:Grid', 'grid.py', 'setup.py',
    'control_field/grid.py:Grid.cell_from_world', 'control_field.grid', 'msgs_bridge.node',
    'control_field.grid.Grid', 'doc/adr/0018', 'config/robots', 'bags/kitchen/', '/tf', 'odom',
    'a / b', 'rclpy.node.Node'])
def test_what_is_there_may_be_named(name):
    assert documents.is_there(name)


@pytest.mark.parametrize('name', [
    'control_field/gird.py', 'control_field/grid.py:Gird', 'gird.py', 'control_field.gird',
    'control_field.grid.Gird', 'control_field/grid.py:Grid.gird', 'doc/adr/9999', 'config/robot'])
def test_what_is_not_there_is_found(name):
    assert not documents.is_there(name)
    assert list(documents.wrong_names('doc/page.md', f'See `{name}`.'))


def test_a_link_has_to_lead_somewhere():
    assert not list(documents.wrong_names('doc/page.md', '[maps](maps.md) [x](https://x.org/y)'))
    assert list(documents.wrong_names('doc/page.md', '[maps](map.md)'))


def test_a_walk_has_as_many_stops_as_its_title_says():
    walk = '### A walk (1 files, 2 stops)\n| 1 | `a.py:f` | in |\n| 2 | `a.py:g` | out |\n'
    assert not list(documents.miscounted_walks(walk))
    assert list(documents.miscounted_walks(walk + '| 3 | `b.py:h` | out |\n'))


def test_old_words_do_not_come_back(tmp_path, monkeypatch):
    monkeypatch.setattr(documents, 'ROOT', tmp_path)
    path = tmp_path / 'a.py'
    path.write_text('class SightTable:\n    def f(self, foresight):\n        gaze_at = 1\n'
                    'def test_out_of_sight(): pass\n')
    replaced = documents.replaced_words(GLOSSARY)
    assert replaced == {'sight': 'local grid', 'gaze': 'local grid'}
    found = list(documents.old_words(path, replaced, frozenset()))
    assert [line.split(': ')[1] for line in found] == ['SightTable', 'gaze_at']
    assert not list(documents.old_words(path, replaced, frozenset({'SightTable', 'gaze_at'})))


def test_a_docstring_describes_the_arguments_that_there_are(tmp_path, monkeypatch):
    monkeypatch.setattr(documents, 'ROOT', tmp_path)
    path = tmp_path / 'a.py'
    rows = ('"""', 'Do.', '', 'Parameters', '----------', 'a, *b : int', '', '"""')
    doc = ''.join(f'    {row}\n' for row in rows)
    path.write_text(f'def f(a, *b):\n{doc}class C:\n{doc}    a: int\n')
    assert list(documents.wrong_arguments(path)) == ['a.py:10: C has no argument b']


def test_the_picture_has_every_package():
    assert set(architecture.ROOMS) | {'benchmarks'} == documents.ROOMS
    texts = [text for text in ET.fromstring(architecture.picture()).itertext() if text.strip()]
    inner = {name.split('.')[1] for name in architecture.INNER}
    assert inner | {'teleop_', 'learner_node', 'control_field'} <= set(texts)
