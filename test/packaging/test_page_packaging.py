"""What starts the page, and what checks it, names what exists and says what is missing."""

import ast
from dataclasses import fields
from importlib.util import module_from_spec, spec_from_file_location
import json
import shutil
import subprocess

import pytest

from page_node.settings import Settings
from ros_helpers import ROOT

LAUNCH = ROOT / 'launch/page.launch.py'
CHECKER = ROOT / 'tools/javascript'
BROWSER_SCRIPT = ROOT / '.ci/install_browser'


def calls(function, path=LAUNCH):
    return [node for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == function]


def first_arguments(function, path=LAUNCH):
    return {call.args[0].value for call in calls(function, path)
            if isinstance(call.args[0], ast.Constant)}


def test_every_argument_is_declared_here_or_in_what_it_includes():
    declared = first_arguments('DeclareLaunchArgument')
    included = first_arguments('DeclareLaunchArgument', LAUNCH.with_name('turtlebot.launch.py'))
    used = first_arguments('LaunchConfiguration') | first_arguments('argument')
    assert declared == {'host', 'port', 'token'}
    assert used - declared <= included


def test_what_it_sets_are_parameters_of_the_page():
    [node] = calls('Node')
    [parameters] = [word.value for word in node.keywords if word.arg == 'parameters']
    keys = {key.value for key in parameters.elts[1].keys}
    assert keys <= {field.name for field in fields(Settings)}


def test_launch_reads_it():
    """Runs where ROS is installed: launch is not on the Python package index."""
    pytest.importorskip('launch_ros')
    spec = spec_from_file_location('page_launch', LAUNCH)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    assert len(module.generate_launch_description().entities) == 3 + 1 + 1


def test_the_lock_of_the_checker_names_no_host():
    lock = json.loads((CHECKER / 'package-lock.json').read_text())
    assert all('resolved' not in package and (not name or 'integrity' in package)
               for name, package in lock['packages'].items())
    assert lock['packages']['']['devDependencies'] == json.loads(
        (CHECKER / 'package.json').read_text())['devDependencies']


def programs(folder, **scripts):
    """Return a folder with what a shell script needs and programs that are such scripts."""
    folder.mkdir()
    for name in ('sh', 'sleep', 'cat', 'cksum', 'dirname', 'true'):
        (folder / name).symlink_to(shutil.which(name))
    for name, text in scripts.items():
        path = folder / name.replace('_', '-')
        path.write_text(f'#!/bin/sh\n{text}\n')
        path.chmod(0o755)
    return folder


def shell(script, path, **env):
    return subprocess.run(['/bin/sh', str(script)], env={'PATH': str(path), **env}, cwd=ROOT,
                          capture_output=True, text=True, check=False)


@pytest.mark.parametrize(('there', 'installed'), [
    ((), 'chromium fonts-dejavu-core npm'), (('npm',), 'chromium fonts-dejavu-core'),
    (('chromium',), 'npm'), (('chromium', 'npm'), None)])
def test_ci_installs_what_is_not_there(tmp_path, there, installed):
    calls_of_apt = tmp_path / 'calls'
    path = programs(tmp_path / 'bin', apt_get=f'echo "$@" >>{calls_of_apt}',
                    **dict.fromkeys(there, ''))
    assert shell(BROWSER_SCRIPT, path).returncode == 0
    if installed is None:
        assert not calls_of_apt.exists()
    else:
        assert calls_of_apt.read_text().splitlines()[-1].endswith(
            f'install -y --no-install-recommends {installed}')


def test_without_npm_the_check_is_left_out_in_a_line_and_fails_in_ci(tmp_path):
    path = programs(tmp_path / 'bin')
    script = ROOT / 'tools/check_javascript.sh'
    done = shell(script, path)
    assert (done.returncode, done.stderr) == (0, '')
    assert done.stdout == "JavaScript is not checked: there is no npm ('apt install npm')\n"
    assert shell(script, path, EXPERIENCE_SKIP_NOTHING='1').returncode == 1
