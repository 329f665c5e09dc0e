"""The comparison of imports and package.xml finds what is wrong."""

import re

import pytest

from ros_helpers import ROOT
from tools.check_dependencies import declared_in, Import, imports_in, imports_of, KEYS, problems

PACKAGE_XML = """
<package format="3">
  <depend>rclpy</depend><exec_depend>python3-numpy</exec_depend>
  <test_depend>python3-pytest</test_depend>
</package>
"""
RUN = [Import('rclpy', 'a.py:1'), Import('numpy', 'a.py:2')]
TEST = [Import('pytest', 't.py:1')]


def test_nothing_is_said_when_all_is_declared():
    assert problems(RUN, TEST, PACKAGE_XML) == []


@pytest.mark.parametrize(('run', 'test', 'words'), [
    ([Import('yaml', 'b.py:3')], [], 'b.py:3: imports yaml, .* declare python3-yaml'),
    ([Import('pytest', 'b.py:3')], [], 'b.py:3: imports pytest, .* python3-pytest'),
    ([], [Import('scipy', 't.py:3')], 't.py:3: imports scipy, .* python3-scipy'),
    ([Import('requests', 'b.py:3')], [], 'b.py:3: requests has no rosdep key'),
])
def test_an_undeclared_import_is_named(run, test, words):
    [found] = problems([*RUN, *run], [*TEST, *test], PACKAGE_XML)
    assert re.match(words, found)


def test_a_made_up_key_is_named():
    package = PACKAGE_XML.replace('python3-numpy', 'python3-nunpy')
    assert 'package.xml: python3-nunpy is not a rosdep key known to check_dependencies.py' in (
        problems(RUN, TEST, package))


def test_an_idle_declaration_is_named():
    assert problems(RUN[:1], TEST, PACKAGE_XML) == [
        'package.xml: python3-numpy is declared, but nothing imports it']


def test_what_only_tests_import_is_declared_for_tests():
    for_running = PACKAGE_XML.replace('<test_depend>', '<exec_depend>').replace(
        '</test_depend>', '</exec_depend>')
    assert problems(RUN, TEST, for_running) == [
        'package.xml: python3-pytest is declared for running, but only tests import it']


def test_what_only_runs_is_not_declared_for_tests():
    yaml = PACKAGE_XML.replace('python3-pytest', 'python3-yaml')
    assert problems([*RUN, Import('yaml', 'b.py:3')], [], yaml)[-1] == (
        'package.xml: python3-yaml is declared for tests, but no test imports it')


def test_no_key_is_known_that_is_not_declared():
    assert set(KEYS.values()) <= set.union(*declared_in((ROOT / 'package.xml').read_text()))


def test_imports_are_found_wherever_they_stand(tmp_path):
    (tmp_path / 'a.py').write_text(
        'import os, numpy.linalg\nfrom . import b\nfrom control_field import grid\n'
        'def f():\n    from yaml import load\n')
    assert list(imports_in(tmp_path / 'a.py', tmp_path)) == [
        Import('numpy', 'a.py:1'), Import('yaml', 'a.py:5')]
    assert imports_of(['.'], tmp_path) == list(imports_in(tmp_path / 'a.py', tmp_path))


def test_running_and_testing_are_told_apart():
    assert declared_in(PACKAGE_XML) == ({'rclpy', 'python3-numpy'}, {'python3-pytest'})
