"""The page for the tests of its room: one set of nodes and one browser for a module."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from page_helpers import PageStack, running_browser, running_page, visiting, Visitor
from page_sites import Robot, running_site, Site, tell
from ros_helpers import own_node

if TYPE_CHECKING:
    from playwright.sync_api import Browser

#: Where nothing can steer a browser, as on a robot, what needs that is not even read.
collect_ignore = [] if find_spec('playwright') else [
    path.name for path in Path(__file__).parent.glob('test_*.py')
    if 'playwright' in path.read_text()]


@pytest.fixture(scope='module')
def node_changes() -> dict[str, dict[str, object] | None]:
    """Return parameters by node, for a module that wants others; None for a node: without it."""
    return {}


@pytest.fixture(scope='module')
def page_stack(
    tmp_path_factory: pytest.TempPathFactory, ros_domain: int,
    node_changes: dict[str, dict[str, object] | None],
) -> Iterator[PageStack]:
    """Return simulator, controller, learner and page, on the domain of `ros_node`."""
    with running_page(tmp_path_factory.mktemp('page'), ros_domain, **node_changes) as stack:
        yield stack


@pytest.fixture(scope='module')
def browser() -> Iterator['Browser']:
    """Return a real browser; without one the test is left out, or fails."""
    with running_browser() as browser:
        yield browser


@pytest.fixture
def visitor(browser: 'Browser', page_stack: PageStack) -> Iterator[Visitor]:
    """Return who opens the page: ``page = visitor.open(viewport=PHONE)``."""
    with visiting(browser, page_stack.url) as visitor:
        yield visitor


@pytest.fixture(scope='module')
def page_site(
    tmp_path_factory: pytest.TempPathFactory, ros_domain: int,
) -> Iterator[Site]:
    """Return the page without other nodes, on the domain of `ros_node`."""
    with running_site(tmp_path_factory.mktemp('page'), ros_domain) as (process, url):
        yield Site(process, url)


@pytest.fixture(scope='module')
def listener(page_site: Site, ros_domain: int) -> Iterator[Robot]:
    """Return the other side of cmd_vel_teleop, once it hears the page."""
    with own_node(ros_domain) as node:
        robot = Robot(node, page_site.process)
        with page_site.socket('/drive') as drive:
            # Until both have found each other.
            robot.wait(lambda: tell(drive, {'stop': True}) or robot.heard, 'a first command')
        yield robot


@pytest.fixture
def robot(listener: Robot) -> Robot:
    """Return it when nobody drives any more."""
    listener.wait_for_silence()
    return listener
