"""Whatever becomes of what `experience` says, it ends without a traceback."""

import os
import subprocess
import sys

import pytest

from experience_cli.main import main
from ros_helpers import child_environment
from sample_helpers import sample_copy


@pytest.fixture
def task(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return sample_copy(tmp_path)


def run(*arguments, shell='"$@"', **variables):
    """Run a command in a shell line, its output buffered as in a person's pipe."""
    env = child_environment(variables)
    del env['PYTHONUNBUFFERED']
    return subprocess.run(
        ['bash', '-c', f'set -o pipefail; {shell}', 'bash', sys.executable, '-m',
         'experience_cli.main', *arguments], env=env, capture_output=True, check=False)


@pytest.mark.parametrize('arguments', [
    ['list'], ['show', 'sample/0002'], ['learn', 'bags/sample'], ['--help'], ['list', '--help']])
def test_whoever_reads_it_may_have_seen_enough(task, arguments):
    done = run(*arguments, shell='"$@" | true')
    assert (done.returncode, done.stderr) == (0, b'')


@pytest.mark.parametrize('arguments', [['list'], ['show', 'sample/0002']])
def test_a_full_disk_is_said_in_one_line(task, arguments):
    done = run(*arguments, shell='"$@" >/dev/full')
    [line] = done.stderr.decode().splitlines()
    assert (done.returncode, line) == (
        2, f'experience {arguments[0]}: cannot use a file: no space left on device')


@pytest.mark.parametrize('closed', ['>&-', '2>&-', '>&- 2>&-'])
@pytest.mark.parametrize('arguments', [
    ['learn', 'bags/sample'],
    ['evaluate', '--world', 'task1', '--goal', '4,4', '--demo-start', '1,1', '--trials', '0']])
def test_closed_outputs_are_no_mistake(task, closed, arguments):
    done = run(*arguments, shell=f'"$@" {closed}')
    assert done.returncode == 0, done


def test_a_folder_may_have_a_name_that_is_no_text(task, tmp_path):
    folder = (tmp_path / 'bags').rename(tmp_path / os.fsdecode(b'bags\xff'))
    done = run('repair', str(folder / 'sample'), PYTHONIOENCODING='utf-8:strict')
    assert done.returncode == 0, done.stderr
    assert b'bags\\udcff/sample/0001_demo: whole' in done.stdout


@pytest.mark.parametrize('arguments', [
    ['show', 'sample/0001', '--bags', 'loop'], ['inspect', 'bags/sample', '--out', 'loop'],
    ['learn', 'bags/sample/0001_demo', '--into', 'loop']])
def test_links_that_lead_in_a_circle_are_one_line(task, tmp_path, capsys, arguments):
    (tmp_path / 'loop').symlink_to('loop')
    assert main(arguments) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith(f'experience {arguments[0]}: ')
    assert 'loop' in line
