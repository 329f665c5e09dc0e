"""
Compare what the code imports with what package.xml declares.

Every import from outside the standard library has to be declared with its rosdep key, every key
has to be a real one, and nothing may be declared that nothing uses; for running what only tests
use neither.
"""

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path
import sys
from typing import NamedTuple
import xml.etree.ElementTree as ET

ROOT = Path(__file__).resolve().parent.parent
ROOMS = tuple(sorted(
    path.parent.name for path in ROOT.glob('*/__init__.py') if path.parent.name != 'benchmarks'))
RUN_CODE = (*ROOMS, 'launch')
TEST_CODE = ('test', 'benchmarks')
OURS = frozenset((
    *ROOMS, *(path.stem for path in (ROOT / 'test').glob('*.py')), 'benchmarks', 'tools'))

# Import name -> rosdep key, looked up in rosdistro (rosdep/python.yaml, jazzy/distribution.yaml).
KEYS = {
    'PIL': 'python3-pil',
    'builtin_interfaces': 'builtin_interfaces',
    'diagnostic_msgs': 'diagnostic_msgs',
    'geometry_msgs': 'geometry_msgs',
    'hypothesis': 'python3-hypothesis',
    'launch': 'launch',
    'launch_ros': 'launch_ros',
    'matplotlib': 'python3-matplotlib',
    'mcap': 'mcap-ros2-support',
    'mcap_ros2': 'mcap-ros2-support',
    'nav_msgs': 'nav_msgs',
    'networkx': 'python3-networkx',
    'numba': 'python3-numba',
    'numpy': 'python3-numpy',
    'pytest': 'python3-pytest',
    'rcl_interfaces': 'rcl_interfaces',
    'rclpy': 'rclpy',
    'rosbags': 'python3-rosbags-pip',
    'rosgraph_msgs': 'rosgraph_msgs',
    'ruamel': 'python3-ruamel.yaml',
    'scipy': 'python3-scipy',
    'sensor_msgs': 'sensor_msgs',
    'starlette': 'python3-fastapi',
    'std_msgs': 'std_msgs',
    'std_srvs': 'std_srvs',
    'tf2_msgs': 'tf2_msgs',
    'tqdm': 'python3-tqdm',
    'uvicorn': 'python3-uvicorn',
    'visualization_msgs': 'visualization_msgs',
    'websockets': 'python3-websockets',
    'yaml': 'python3-yaml',
}
# Declared for what launch files, pytest and uvicorn load, not for an import.
TOOLS = frozenset({
    'python3-pytest-timeout', 'python3-pytest-xdist', 'python3-websockets', 'ros2launch', 'rviz2',
    'tf2_ros'})
# Nothing on a robot imports these; they come with the virtual environment, or are installed by who
# wants them (atheris).
VENV_ONLY = frozenset({'setuptools', 'atheris', 'axe_playwright_python', 'playwright'})


class Import(NamedTuple):
    """One import of a package from outside."""

    name: str
    """Top-level name."""
    where: str
    """`file:line`."""


def imports_in(path: Path, root: Path = ROOT) -> Iterator[Import]:
    """Yield what a file imports that is neither ours nor of the standard library."""
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        for name, line in _names(node):
            top = name.split('.')[0]
            if top not in sys.stdlib_module_names and top not in OURS:
                yield Import(top, f'{path.relative_to(root)}:{line}')


def _names(node: ast.AST) -> list[tuple[str, int]]:
    """Return what a node imports, and in which line."""
    if isinstance(node, ast.Import):
        return [(alias.name, node.lineno) for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module and not node.level:
        return [(node.module, node.lineno)]
    return []


def declared_in(package_xml: str) -> tuple[set[str], set[str]]:
    """Return the keys declared for running and those declared for testing only."""
    package = ET.fromstring(package_xml)  # noqa: S314 - it is our own
    run = {e.text or '' for tag in ('depend', 'exec_depend') for e in package.iter(tag)}
    return run, {e.text or '' for e in package.iter('test_depend')}


def problems(run: Iterable[Import], test: Iterable[Import], package_xml: str) -> list[str]:
    """
    Compare imports with declarations.

    Parameters
    ----------
    run, test : iterable of Import
        What the installed code imports, and what tests and benchmarks import.
    package_xml : str

    Returns
    -------
    list of str
        One sentence a problem; empty if all is well.

    """
    run, test = list(run), list(test)
    run_keys, test_keys = declared_in(package_xml)
    found = [*_missing(run, run_keys), *_missing(test, run_keys | test_keys)]
    return [*found, *_idle(run_keys, test_keys, run, test)]


def _idle(
    run_keys: set[str], test_keys: set[str], run: list[Import], test: list[Import],
) -> Iterator[str]:
    """Yield what is wrong with keys that are declared."""
    in_run, in_test = ({KEYS.get(i.name) for i in imports} for imports in (run, test))
    for key in sorted((run_keys | test_keys) - TOOLS):
        if key not in KEYS.values():
            yield f'package.xml: {key} is not a rosdep key known to {Path(__file__).name}'
        elif key not in in_run | in_test:
            yield f'package.xml: {key} is declared, but nothing imports it'
        elif key in run_keys - in_run:
            yield f'package.xml: {key} is declared for running, but only tests import it'
        elif key in test_keys - in_test:
            yield f'package.xml: {key} is declared for tests, but no test imports it'


def _missing(imports: Iterable[Import], keys: set[str]) -> Iterator[str]:
    for name, where in imports:
        if name in VENV_ONLY:
            continue
        if name not in KEYS:
            yield f'{where}: {name} has no rosdep key; look it up and add it to KEYS'
        elif KEYS[name] not in keys:
            yield f'{where}: imports {name}, but package.xml does not declare {KEYS[name]}'


def imports_of(folders: Iterable[str], root: Path = ROOT) -> list[Import]:
    """Return what all Python files below these folders import from outside."""
    paths = (path for folder in folders for path in sorted((root / folder).rglob('*.py')))
    return [found for path in paths for found in imports_in(path, root)]


def main() -> int:
    """Print the problems; return 1 if there are any."""
    found = problems(
        imports_of(RUN_CODE), imports_of(TEST_CODE), (ROOT / 'package.xml').read_text())
    print('\n'.join(found) or 'package.xml declares what is imported.')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
