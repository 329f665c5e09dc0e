"""What every test may ask for: a ROS domain of its own, a node of its own, steady settings."""

from collections import Counter
from collections.abc import Iterator
import os
import sys

from hypothesis import HealthCheck, settings
import pytest

import browsers
from experience_cli.demo.processes import free_domain
import ros_helpers

# A busy machine is slow now and then; that is no error of the code under test.
settings.register_profile(
    'search', deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile('steady', settings.get_profile('search'), derandomize=True)
# The same examples every time, so that a red suite means a changed one; new ones are searched for
# with HYPOTHESIS_PROFILE=search.
settings.load_profile(os.environ.get('HYPOTHESIS_PROFILE', 'steady'))

FAILED = pytest.StashKey[bool]()


def pytest_xdist_auto_num_workers() -> int:
    """Return two workers a core: half of the time a test waits, for nodes that wait themselves."""
    return min(2 * len(os.sched_getaffinity(0)), 24)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """
    Run tests that talk over DDS again if they fail (doc/adr/0009), if the plugin is there.

    Those that need a browser are left out where there is none.
    """
    if browsers.are_left_out():
        config.hook.pytest_deselected(items=[item for item in items if needs_browser(item)])
        items[:] = [item for item in items if not needs_browser(item)]
    if config.pluginmanager.hasplugin('rerunfailures'):
        for item in items:
            if talks(item):
                item.add_marker(pytest.mark.flaky(reruns=2))
    if 'PYTEST_XDIST_WORKER' in os.environ:
        # Whole files are given to the workers, in this order: what takes long begins first.
        seconds = Counter()
        for item in items:
            seconds[item.path] += 10 * bool(item.get_closest_marker('slow')) + 2 * talks(item)
        items.sort(key=lambda item: -seconds[item.path])


def talks(item: pytest.Item) -> bool:
    """Return True for a test whose processes or nodes talk over DDS."""
    return 'ros_domain' in getattr(item, 'fixturenames', ())


def needs_browser(item: pytest.Item) -> bool:
    """Return True for a test that opens the page."""
    return 'browser' in getattr(item, 'fixturenames', ())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Note whether this run of a test failed."""
    report = yield
    item.stash[FAILED] = report.failed or (report.when != 'setup' and item.stash[FAILED])
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> None:
    """Stop all nodes after a failure, those of the module, too: the next run gets new ones."""
    if item.stash[FAILED] and talks(item):
        item.session._setupstate.teardown_exact(item.session)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Show in full what failed before it passed, to be looked into too; say what is left out."""
    if browsers.are_left_out():
        terminalreporter.line(f'left out: {browsers.HOW_TO_GET_ONE}')
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
    ros_helpers.end_fork_server()


@pytest.fixture(scope='session')
def quiet_domain(steady_environment: None) -> Iterator[int]:
    """Return a ROS_DOMAIN_ID that nobody else on this machine uses, for who talks to nobody."""
    with free_domain() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_DOMAIN_ID', str(domain))
        yield domain


@pytest.fixture(scope='session')
def ros_domain(quiet_domain: int) -> int:
    """Return the same for those who talk there: such a test is run again when it fails."""
    return quiet_domain


@pytest.fixture
def ros_node(ros_domain: int) -> Iterator['ros_helpers.Node']:
    """Return a node in this process, on the tests' domain; `ros_helpers.wait_until` spins it."""
    with ros_helpers.own_node(ros_domain) as node:
        yield node
