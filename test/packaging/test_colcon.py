"""What a ROS user does: build with colcon, source, run, and ask the ament index."""

from collections.abc import Mapping
from importlib.metadata import distribution
from pathlib import Path
import re
import shutil
import sys

import pytest

from ros_helpers import Process, ROOT, run, wait_until

pytestmark = pytest.mark.slow

PACKAGE = 'experience_controller'
EXECUTABLES = {
    entry.name: entry.module for entry in distribution(PACKAGE).entry_points
    if entry.group == 'console_scripts'
}
#: There is no terminal to read keys from, and somebody may have the usual port.
ARGUMENTS = {'teleop_node': ('--ros-args', '-p', 'keyboard:=false'),
             'page_node': ('--ros-args', '-p', 'port:=0')}
NODES = sorted(name for name in EXECUTABLES if name.endswith('_node'))
NOT_SOURCE = shutil.ignore_patterns(
    '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'out', 'bags')
LOG = re.compile(r'^(\[(DEBUG|INFO|WARN)\] .*)?$')


def colcon(folder: Path, *arguments: str, env: Mapping[str, str] | None = None) -> str:
    command = [str(Path(sys.executable).parent / 'colcon'), *arguments]
    done = run(command, folder, {'PYTHONPATH': '', **(env or {})}, deadline=120, cwd=folder)
    assert done.popen.returncode == 0, done.report()
    return done.stdout


@pytest.fixture(scope='module')
def workspace(tmp_path_factory):
    """Return a workspace with this package built."""
    folder = tmp_path_factory.mktemp('workspace')
    shutil.copytree(ROOT, folder / 'src' / PACKAGE, ignore=NOT_SOURCE)
    colcon(folder, 'build')
    return folder


@pytest.fixture(scope='module')
def sourced(workspace, ros_domain):
    """Return the environment after `source install/setup.bash`."""
    command = ['bash', '-c', '. install/setup.bash && env -0']
    done = run(command, workspace, {'PYTHONPATH': ''}, cwd=workspace)
    assert done.popen.returncode == 0, done.report()
    return dict(pair.split('=', 1) for pair in done.stdout.split('\0') if pair)


def executable(workspace, name):
    return workspace / 'install' / PACKAGE / 'lib' / PACKAGE / name


def test_executables_lie_where_ros2_run_looks(workspace):
    folder = executable(workspace, '')
    assert {path.name for path in folder.iterdir()} == set(EXECUTABLES)
    assert {'sim_node', 'control_field_node', 'learner_node', 'teleop_node', 'neighbourhood_node',
            'localised_odometry_node', 'page_node', 'experience'} == set(EXECUTABLES)


def test_share_holds_what_launch_needs(workspace):
    share = workspace / 'install' / PACKAGE / 'share' / PACKAGE
    for name in ('package.xml', 'launch/demo.launch.py', 'config/demo.yaml',
                 'config/experience.rviz', 'config/worlds/task1.yaml',
                 'config/worlds/task2.yaml'):
        assert (share / name).is_file()
    worlds = {path.name for path in (ROOT / 'config/worlds').iterdir()}
    assert {path.name for path in (share / 'config/worlds').iterdir()} == worlds


def test_browsers_get_the_whole_page(workspace):
    installed = workspace / 'install' / PACKAGE / 'lib'
    [static] = installed.glob('python3*/site-packages/page_node/static')
    files = {path.relative_to(static) for path in static.rglob('*') if path.is_file()}
    source = ROOT / 'page_node/static'
    assert files == {path.relative_to(source) for path in source.rglob('*') if path.is_file()}


def test_the_ament_index_knows_the_package(workspace, sourced):
    code = ('from ament_index_python import get_package_share_directory as share, '
            f'get_packages_with_prefixes as all; print(share("{PACKAGE}")); '
            f'print(all()["{PACKAGE}"])')
    done = run([sys.executable, '-c', code], workspace, sourced, cwd=workspace)
    prefix = workspace / 'install' / PACKAGE
    assert done.stdout.split() == [str(prefix / 'share' / PACKAGE), str(prefix)]


@pytest.mark.parametrize('name', NODES)
def test_a_node_starts_and_stops(workspace, sourced, ros_node, name):
    command = [str(executable(workspace, name)), *ARGUMENTS.get(name, ())]
    with Process(command, workspace, sourced, cwd=workspace) as process:
        wait_until(lambda: name in ros_node.get_node_names(), node=ros_node,
                   processes=[process], what=name)
    assert process.popen.returncode == 0
    assert [line for line in process.stderr.splitlines() if not LOG.match(line)] == []


def test_the_command_line_tool_starts(workspace, sourced):
    command = [str(executable(workspace, 'experience')), '--help']
    done = run(command, workspace, sourced, cwd=workspace)
    assert done.popen.returncode == 0, done.report()
    assert 'demo' in done.stdout
    assert done.stderr == ''


def test_colcon_test_runs_tests(workspace, sourced):
    few = 'test/packaging/test_check_dependencies.py'
    colcon(workspace, 'test', '--return-code-on-test-failure', '--pytest-args', few, env=sourced)
    summary = re.search(r'(\d+) tests, 0 errors, 0 failures', colcon(workspace, 'test-result'))
    assert summary, 'colcon test-result says something else'
    assert int(summary[1]) >= 5
