"""The page for the tests of its room: one set of nodes and one browser for a module."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from page_helpers import PageStack, running_browser, running_page, visiting, Visitor

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
