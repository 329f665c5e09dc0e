"""What every test may ask for: a ROS domain of its own, a node of its own, steady settings."""

from collections.abc import Iterator
import os
import subprocess
import sys

from hypothesis import HealthCheck, settings
import pytest

import ros_helpers

# A busy machine is slow now and then; that is no error of the code under test.
settings.register_profile(
    'search', deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile('steady', settings.get_profile('search'), derandomize=True)
# The same examples every time, so that a red suite means a changed one; new ones are searched for
# with HYPOTHESIS_PROFILE=search.
settings.load_profile(os.environ.get('HYPOTHESIS_PROFILE', 'steady'))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Run tests of real processes again if they fail (doc/adr/0009), where the plugin is there."""
    if config.pluginmanager.hasplugin('rerunfailures'):
        for item in items:
            if starts_processes(item):
                item.add_marker(pytest.mark.flaky(reruns=2))


def starts_processes(item: pytest.Item) -> bool:
    """Tell whether a test talks over real DDS, or stands in a file that starts processes."""
    starters = (subprocess, ros_helpers.Process, ros_helpers.run, ros_helpers.start_node)
    known = vars(getattr(item, 'module', object)).values()
    return 'ros_domain' in getattr(item, 'fixturenames', ()) or any(
        value is starter for value in known for starter in starters)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Show in full what failed before it passed: that is looked into, too."""
    for report in terminalreporter.stats.get('rerun', []):
        terminalreporter.section(f'FAILED AT FIRST: {report.nodeid}', red=True)
        terminalreporter.line(report.longreprtext)


@pytest.fixture(scope='session', autouse=True)
def steady_environment() -> Iterator[None]:
    """Keep ROS on this machine and its settings the same for whoever runs the tests."""
    ros_helpers.listen_to_interrupts()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        patch.setenv('MPLBACKEND', 'Agg')
        for name in ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS', 'RCUTILS_LOGGING_USE_STDOUT'):
            patch.delenv(name, raising=False)
        if 'AMENT_PREFIX_PATH' not in os.environ:
            patch.setenv('AMENT_PREFIX_PATH', sys.prefix)
        yield


@pytest.fixture(scope='session')
def ros_domain(steady_environment: None) -> Iterator[int]:
    """Return a ROS_DOMAIN_ID that no other worker and no other session on this machine uses."""
    with ros_helpers.own_domain() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain


@pytest.fixture
def ros_node(ros_domain: int) -> Iterator['ros_helpers.Node']:
    """Return a node in this process, on the tests' domain; `ros_helpers.wait_until` spins it."""
    with ros_helpers.own_node(ros_domain) as node:
        yield node
