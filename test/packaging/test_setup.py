"""`make setup` does nothing twice, makes up for a failure, and says what is missing."""

import shutil
import sys
import time

import pytest

from ros_helpers import ROOT, run

UTILITIES = ('sh', 'dirname', 'cat', 'cksum', 'rm', 'mkdir', 'ln', 'mv', 'pwd')
NEEDED = (
    'requirements-build.lock', 'requirements.lock', 'requirements-dev.lock', 'setup.py',
    'setup.cfg', 'pyproject.toml', 'experience_cli/quiet_start.py')


@pytest.fixture
def tree(tmp_path):
    """Return a folder with what setup.sh reads, and `bin` with hardly any programs."""
    for folder in ('tools', 'experience_cli'):
        (tmp_path / 'tree' / folder).mkdir(parents=True)
    for name in (*NEEDED, 'tools/setup.sh'):
        shutil.copy(ROOT / name, tmp_path / 'tree' / name)
    (tmp_path / 'bin').mkdir()
    for name in UTILITIES:
        (tmp_path / 'bin' / name).symlink_to(shutil.which(name))
    return tmp_path / 'tree'


def program(tree, name, text):
    path = tree.parent / 'bin' / name
    path.write_text(f'#!/bin/sh\n{text}\n')
    path.chmod(0o755)
    return path


def setup(tree, *arguments, **env):
    env = {'PATH': str(tree.parent / 'bin'), 'PYTHON': '', 'VENV': '.venv', **env}
    return run(['/bin/sh', 'tools/setup.sh', *arguments], tree.parent, env, cwd=tree)


def test_no_python_is_one_clear_line(tree):
    program(tree, 'python3.12', 'echo "shim: not here" >&2; exit 127')
    program(tree, 'python3', 'exit 1')
    done = setup(tree)
    assert (done.popen.returncode, done.stdout) == (2, '')
    [line] = done.stderr.splitlines()
    assert 'found no Python 3.11 or 3.12; install one' in line


def test_a_wrong_python_is_one_clear_line(tree):
    done = setup(tree, PYTHON='/nowhere/python3')
    assert done.popen.returncode == 2
    assert done.stderr == 'setup: PYTHON=/nowhere/python3 is not a working Python 3.11 or 3.12\n'


def test_no_venv_module_is_one_clear_line(tree):
    program(tree, 'python3.11', f"""case "$2" in *ensurepip*) exit 1;; esac
exec {sys.executable} "$@" """)
    done = setup(tree)
    assert done.popen.returncode == 2
    [line] = done.stderr.splitlines()
    assert 'python3.11 cannot make virtual environments' in line
    assert 'apt install python3-venv' in line


def make_stub(tree):
    """Make a Python whose virtual environments are stubs that write down their calls."""
    calls = tree / 'calls'
    stub = tree.parent / 'stub'
    stub.write_text(f"""#!/bin/sh
if [ "$1" = -c ]; then exec {sys.executable} "$@"; fi
if [ "$1" = --version ]; then echo Python stub; exit; fi
echo "$@" >>{calls}
if [ -f {tree}/fail ]; then exit 1; fi
if [ "$2" = venv ]; then
    mkdir -p "$3/bin" "$3/share/ament_index/resource_index/packages" \
        "$3/lib/python3.12/site-packages"
    echo '#!/some/bin/python3.12' >"$3/bin/experience"
    echo 'import of the command' >>"$3/bin/experience"
    echo '#!/bin/sh' >"$3/bin/sim_node"
    ln -s {stub} "$3/bin/python"
    ln -s {stub} "$3/bin/uv"
fi
""")
    stub.chmod(0o755)
    (tree.parent / 'bin/python3.12').symlink_to(stub)
    return calls


def calls_of(tree, calls, *arguments):
    """Run the set-up; return its exit code and how many commands it gave."""
    calls.write_text('')
    code = setup(tree, *arguments).popen.returncode
    return code, len(calls.read_text().splitlines())


def test_what_is_done_is_not_done_again(tree):
    calls = make_stub(tree)
    assert calls_of(tree, calls) == (0, 4)  # the folder, the builder, the rest, the project
    took = []
    for _ in range(5):  # one of them is not held up by what else the machine does
        start = time.monotonic()
        assert calls_of(tree, calls) == (0, 0)
        took.append(time.monotonic() - start)
    assert min(took) < 1.0
    assert (tree / '.venv/share/experience_controller/config').readlink() == tree / 'config'


def test_what_failed_is_done_again(tree):
    calls = make_stub(tree)
    (tree / 'fail').touch()
    assert calls_of(tree, calls)[0] == 2
    (tree / 'fail').unlink()
    assert calls_of(tree, calls) == (0, 4)


def test_tools_come_on_top_and_only_when_asked_for(tree):
    calls = make_stub(tree)
    assert calls_of(tree, calls) == (0, 4)
    assert 'requirements-dev' not in calls.read_text()
    assert calls_of(tree, calls, 'tools') == (0, 1)
    assert 'requirements-dev.lock' in calls.read_text()
    assert calls_of(tree, calls, 'tools') == calls_of(tree, calls) == (0, 0)
    with (tree / 'requirements-dev.lock').open('a') as file:
        file.write('\n# changed\n')
    assert calls_of(tree, calls) == (0, 0)
    assert calls_of(tree, calls, 'tools') == (0, 1)


def test_scripts_hear_ctrl_c_from_the_first_moment_on(tree):
    make_stub(tree)
    setup(tree)
    for _ in range(2):
        script = (tree / '.venv/bin/experience').read_text().splitlines()
        assert script == ['#!/usr/bin/env -S --block-signal=INT /some/bin/python3.12',
                          'import of the command']
        (tree / '.venv/setup-stamp-project_key').unlink()
        setup(tree)
    assert (tree / '.venv/bin/sim_node').read_text() == '#!/bin/sh\n'
    packages = tree / '.venv/lib/python3.12/site-packages'
    [first, module] = sorted(path.name for path in packages.iterdir())
    assert (packages / first).read_text() == f'import {module.removesuffix(".py")}\n'
    assert first == '00_experience_quiet_start.pth'


def test_what_runs_needs_no_tools():
    run_lock, dev_lock = ((ROOT / f'requirements{name}.lock').read_text() for name in ('', '-dev'))
    names = [{line.split()[0] for line in text.splitlines() if '==' in line}
             for text in (run_lock, dev_lock)]
    assert names[0] < names[1]  # the very same versions
    assert not {name.split('==')[0] for name in names[0]} & {
        'mypy', 'ruff', 'pytest', 'scipy', 'hypothesis', 'networkx', 'colcon-core'}


@pytest.mark.parametrize(('name', 'n_calls'), [
    ('requirements.lock', 4), ('requirements-build.lock', 4), ('tools/setup.sh', 4),
    ('setup.py', 1), ('pyproject.toml', 1), ('experience_cli/quiet_start.py', 1),
])
def test_a_change_is_noticed(tree, name, n_calls):
    calls = make_stub(tree)
    setup(tree)
    with (tree / name).open('a') as file:
        file.write('\n# changed\n')
    assert calls_of(tree, calls) == (0, n_calls)
    assert calls_of(tree, calls) == (0, 0)


def test_a_moved_folder_is_made_anew(tree):
    make_stub(tree)
    setup(tree)
    moved = tree.rename(tree.parent / 'moved')
    shutil.copytree(moved, tree, symlinks=True)  # where the stub writes its calls
    assert setup(moved).stdout.startswith('setup: making .venv')


def test_a_folder_whose_python_is_gone_is_made_anew(tree):
    calls = make_stub(tree)
    setup(tree)
    (tree / '.venv/bin/python').unlink()
    assert calls_of(tree, calls) == (0, 4)
