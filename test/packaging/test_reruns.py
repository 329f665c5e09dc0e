"""Tests that talk over DDS are run again when they fail, others are not (doc/adr/0009)."""

import os
from pathlib import Path
import shutil
import sys

import pytest

from ros_helpers import run

TESTS = Path(__file__).parents[1]
pytest.importorskip('pytest_rerunfailures')


def run_tests(folder, source):
    """Run tests with this folder's conftest; return the exit code and what was printed."""
    shutil.copy(TESTS / 'conftest.py', folder)
    (folder / 'pytest.ini').write_text('[pytest]\n')
    (folder / 'test_it.py').write_text(f'runs = []\n{source}')
    process = run(
        [sys.executable, '-m', 'pytest', '-p', 'no:cacheprovider', str(folder)], folder,
        cwd=folder, env={'PYTHONPATH': os.pathsep.join((str(TESTS), str(TESTS.parent)))})
    return process.popen.returncode, process.stdout


@pytest.mark.parametrize(('fixture', 'passes', 'code', 'words'), [
    ('ros_domain', 2, 0, ['1 passed', '1 rerun', 'FAILED AT FIRST', 'this is run 1']),
    ('ros_domain', 3, 0, ['1 passed', '2 rerun', 'FAILED AT FIRST', 'this is run 2']),
    ('ros_domain', 4, 1, ['1 failed', '2 rerun', 'FAILED AT FIRST', 'this is run 3']),
    ('quiet_domain', 2, 1, ['1 failed', 'this is run 1']),
])
def test_what_talks_over_dds_is_run_again(tmp_path, fixture, passes, code, words):
    found, printed = run_tests(tmp_path, f"""
def test_it({fixture}):
    runs.append(1)
    assert len(runs) >= {passes}, f'this is run {{len(runs)}}'
""")
    assert found == code, printed
    for word in words:
        assert word in printed
    assert ('FAILED AT FIRST' in printed) == (fixture == 'ros_domain')


def test_the_next_run_gets_new_nodes_of_the_module_and_keeps_what_is_the_sessions(tmp_path):
    code, printed = run_tests(tmp_path, """
import pytest

@pytest.fixture(scope='module')
def nodes(ros_domain):
    runs.append(ros_domain)
    yield len(runs)
    runs.append('stopped')

def test_before(nodes):
    assert nodes == 1

def test_it(nodes):
    assert nodes == 3
    assert runs == [runs[0], 'stopped', runs[0]]

def test_after(nodes):
    assert nodes == 3
""")
    assert (code, '1 rerun' in printed) == (0, True), printed


@pytest.mark.parametrize('module', ['import subprocess', 'from ros_helpers import run'])
def test_who_starts_processes_that_talk_to_nobody_has_one_chance(tmp_path, module):
    code, printed = run_tests(tmp_path, f"""
{module}
def test_it(quiet_domain):
    runs.append(1)
    assert len(runs) == 2
""")
    assert (code, 'rerun' in printed.splitlines()[-1]) == (1, False), printed
