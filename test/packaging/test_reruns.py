"""Tests that talk over DDS are run again when they fail, others are not (doc/adr/0009)."""

import os
from pathlib import Path
import re
import shutil
import sys

import pytest

from ros_helpers import run

TESTS = Path(__file__).parents[1]
pytest.importorskip('pytest_rerunfailures')


#: File, what it holds after `runs = []`, and what is said of its test in the end.
FILES = {
    'second': ('def test_second(ros_domain):\n    run(2)', ['RERUN', 'PASSED']),
    'third': ('def test_third(ros_domain):\n    run(3)', ['RERUN', 'RERUN', 'PASSED']),
    'never': ('def test_never(ros_domain):\n    run(4)', ['RERUN', 'RERUN', 'FAILED']),
    'quiet': ('from ros_helpers import start_node\ndef test_quiet(quiet_domain):\n    run(2)',
              ['FAILED']),
    'core': ('def test_core(tmp_path):\n    run(2)', ['FAILED']),
    'module': ("""
import pytest

@pytest.fixture(scope='module')
def nodes(ros_domain):
    runs.append(ros_domain)
    yield len(runs)
    runs.append('stopped')

def test_before(nodes):
    assert nodes == 1

def test_module(nodes):
    assert nodes == 3
    assert runs == [runs[0], 'stopped', runs[0]]

def test_after(nodes):
    assert nodes == 3
""", ['RERUN', 'PASSED'])}
RUN = """
runs = []

def run(needed):
    runs.append(1)
    assert len(runs) >= needed, f'this is run {len(runs)} of {needed}'

"""


@pytest.fixture(scope='module')
def printed(tmp_path_factory):
    """Run the files with this folder's conftest; return what was printed."""
    folder = tmp_path_factory.mktemp('suite')
    shutil.copy(TESTS / 'conftest.py', folder)
    (folder / 'pytest.ini').write_text('[pytest]\n')
    for name, (source, _) in FILES.items():
        (folder / f'test_{name}.py').write_text(RUN + source)
    process = run(
        [sys.executable, '-m', 'pytest', '-v', '-p', 'no:cacheprovider', str(folder)], folder,
        cwd=folder, env={'PYTHONPATH': os.pathsep.join((str(TESTS), str(TESTS.parent)))})
    assert process.popen.returncode == 1, process.report()
    return process.stdout


@pytest.mark.parametrize('name', FILES)
def test_what_talks_over_dds_is_run_again_and_nothing_else(printed, name):
    test, words = f'test_{name}.py::test_{name}', FILES[name][1]
    assert re.findall(rf'^{test} (\w+) +\[', printed, re.MULTILINE) == words
    assert printed.count(f'FAILED AT FIRST: {test}') == words.count('RERUN')


def test_what_failed_at_first_is_shown_and_the_next_run_gets_new_nodes_of_the_module(printed):
    for text in ('this is run 1 of 2', 'this is run 2 of 3', 'this is run 3 of 4'):
        assert text in printed
    assert printed.splitlines()[-1].count('3 failed, 5 passed, 6 rerun')
