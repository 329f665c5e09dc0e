"""Whatever becomes of what `experience` says, it ends without a traceback."""

import io
import os
from pathlib import Path
import subprocess
import sys

import pytest

from experience_cli.main import main
from ros_helpers import child_environment

EVALUATE = ['evaluate', '--world', 'task1', '--goal', '4,4', '--demo-start', '1,1', '--trials',
            '0', '--seeds', '1']


def run(*arguments, shell):
    """Run a command in a shell line, its output buffered as in a person's pipe."""
    env = child_environment()
    del env['PYTHONUNBUFFERED']
    return subprocess.run(
        ['bash', '-c', f'set -o pipefail; {shell}', 'bash', sys.executable, '-m',
         'experience_cli.main', *arguments], env=env, capture_output=True, check=False)


def test_a_closed_pipe_a_full_disk_and_closed_outputs_of_a_real_process(task):
    done = run('list', shell='"$@" | true')
    assert (done.returncode, done.stderr) == (0, b'')
    done = run('list', shell='"$@" >/dev/full')
    assert (done.returncode, done.stderr.decode()) == (
        2, 'experience list: cannot use a file: no space left on device\n')
    done = run('learn', 'bags/sample', shell='"$@" >&- 2>&-')
    assert done.returncode == 0, done


@pytest.mark.parametrize('arguments', [
    ['list'], ['show', 'sample/0002'], ['learn', 'bags/sample'], ['--help'], ['list', '--help']])
def test_whoever_reads_it_may_have_seen_enough(task, capsys, monkeypatch, arguments):
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, 'w') as pipe:
        monkeypatch.setattr(sys, 'stdout', pipe)
        assert code_of(arguments) == 0
    assert capsys.readouterr().err == ''


def code_of(arguments):
    """Run a command; return its exit code, or that of the parser."""
    try:
        return main(arguments)
    except SystemExit as ended:
        return ended.code


@pytest.mark.parametrize('arguments', [['list'], ['show', 'sample/0002']])
def test_a_full_disk_is_said_in_one_line(task, capsys, monkeypatch, arguments):
    with Path('/dev/full').open('w') as full:
        monkeypatch.setattr(sys, 'stdout', full)
        assert main(arguments) == 2
    assert capsys.readouterr().err == (
        f'experience {arguments[0]}: cannot use a file: no space left on device\n')


@pytest.mark.parametrize('closed', [['stdout'], ['stderr'], ['stdout', 'stderr']])
@pytest.mark.parametrize('arguments', [['learn', 'bags/sample'], EVALUATE])
def test_closed_outputs_are_no_mistake(task, monkeypatch, closed, arguments):
    for name in closed:
        monkeypatch.setattr(sys, name, None)
    assert main(arguments) == 0
    for name in closed:
        getattr(sys, name).close()


def test_a_folder_may_have_a_name_that_is_no_text(task, tmp_path, monkeypatch):
    folder = (tmp_path / 'bags').rename(tmp_path / os.fsdecode(b'bags\xff'))
    written = io.BytesIO()
    monkeypatch.setattr(sys, 'stdout', io.TextIOWrapper(written, 'utf-8', 'strict'))
    assert main(['repair', str(folder / 'sample')]) == 0
    assert b'bags\\udcff/sample/0001_demo: whole' in written.getvalue()


@pytest.mark.parametrize('arguments', [
    ['show', 'sample/0001', '--bags', 'loop'], ['inspect', 'bags/sample', '--out', 'loop'],
    ['learn', 'bags/sample/0001_demo', '--into', 'loop']])
def test_links_that_lead_in_a_circle_are_one_line(task, tmp_path, mistake, arguments):
    (tmp_path / 'loop').symlink_to('loop')
    assert 'loop' in mistake(*arguments)
