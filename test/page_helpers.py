"""The page on real nodes and in a real browser; fixtures of them are in test/page_node."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, ExitStack
import os
from pathlib import Path
import re
from typing import Any, TYPE_CHECKING

import pytest

from browsers import chromium, HOW_TO_GET_ONE
from ros_helpers import Process, start_node, wait_until

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

#: Sizes of screens, [px].
PHONE = {'width': 390, 'height': 844}
LAPTOP = {'width': 1366, 'height': 768}
PROJECTOR = {'width': 1920, 'height': 1080}
#: Of what a browser writes about a page where nobody looks.
LEVELS = ('error', 'warning')
PARAMETERS: Mapping[str, Mapping[str, Any]] = {
    'sim_node': {'world': 'open', 'rate': 20.0},
    'control_field_node': {'profile': 'full'},
    'learner_node': {'simulation': True, 'task': 'task', 'profile': 'full'},
    'page_node': {'port': 0, 'simulation': True},
}


class PageStack:
    """
    Simulator, controller, learner and page, each a process, and where the page is.

    Parameters
    ----------
    folder : Path
        For bags, parameter files and what the nodes say.
    domain : int
        ROS domain of all of them.
    stack : ExitStack
        Stops them at its end; each has to end with exit code 0.
    **changes
        Parameters of a node on top of `PARAMETERS`, by its name; None: the node is not started.

    """

    def __init__(
        self, folder: Path, domain: int, stack: ExitStack, **changes: Mapping[str, Any] | None,
    ) -> None:
        self.folder, self.bags = folder, folder / 'bags'
        self.processes: dict[str, Process] = {}
        self._domain, self._stack = domain, stack
        self._changes = {name: changes.get(name, {}) for name in PARAMETERS}
        for name in PARAMETERS:
            if self._changes[name] is not None:
                self.start(name)
        self.url = self.find_url()

    def start(self, name: str, **changes: Any) -> Process:
        """Start one of the nodes, or another time after `kill`."""
        folders = {'bags': str(self.bags)} if name in ('learner_node', 'page_node') else {}
        parameters = {**PARAMETERS[name], **folders, **(self._changes[name] or {}), **changes}
        process = start_node(f'{name}.node', self.folder, parameters,
                             env={'ROS_DOMAIN_ID': str(self._domain)})
        self.processes[name] = self._stack.enter_context(process)
        return process

    def kill(self, name: str) -> None:
        """End a node as a crash would."""
        self.processes.pop(name).kill()

    def find_url(self) -> str:
        """Return the address that page_node says it has, with its token."""
        page = self.processes['page_node']
        found = wait_until(
            lambda: re.search(r'https?://[^\s\'"]+', page.stdout + page.stderr),
            processes=[page], what='the address of the page')
        return found[0]

    def report(self) -> str:
        """Say how all processes stand and what they wrote, for a failing test."""
        return '\n'.join(process.report() for process in self.processes.values())


@contextmanager
def running_page(
    folder: Path, domain: int, **changes: Mapping[str, Any] | None,
) -> Iterator[PageStack]:
    """Start the nodes, stop them at the end; arguments are those of `PageStack`."""
    folder.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        yield PageStack(folder, domain, stack, **changes)


@contextmanager
def running_browser() -> Iterator['Browser']:
    """Start the browser without a window; fail where there is none."""
    executable = chromium()
    if executable is None:
        pytest.fail(HOW_TO_GET_ONE, pytrace=False)
    # Where it is not installed, the page's other tests are there.
    from playwright.sync_api import sync_playwright  # noqa: PLC0415
    # Its own sandbox does not work for root.
    options = [] if os.getuid() else ['--no-sandbox']
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=options)
        try:
            yield browser
        finally:
            browser.close()


class Visitor:
    """
    Opens pages in a browser; each has cookies and settings of its own, like another person's.

    Parameters
    ----------
    browser : Browser
    url : str
        Where the page is.
    stack : ExitStack
        Closes what was opened.

    """

    def __init__(self, browser: 'Browser', url: str, stack: ExitStack) -> None:
        self.browser, self.url = browser, url
        #: What the browser has found wrong: scripts that failed, what the policy has refused.
        self.problems: list[str] = []
        self._stack = stack

    def open(self, path: str = '', **options: Any) -> 'Page':
        """
        Open the page and return it when it has loaded.

        Parameters
        ----------
        path : str
            What is put behind the address, such as '#memory'.
        **options
            Those of Playwright's `Browser.new_context`: `viewport=PHONE`, `has_touch=True`,
            `locale='de'`, `color_scheme='dark'`, `reduced_motion='reduce'`.

        """
        page = self.context(**options).new_page()
        page.goto(self.url + path)
        return page

    def context(self, **options: Any) -> 'BrowserContext':
        """Return a context of the browser, for what has to be done before the page is opened."""
        context = self.browser.new_context(**{'viewport': LAPTOP, 'locale': 'en', **options})
        self._stack.callback(context.close)
        context.on('console', self._note)
        context.on('weberror', lambda error: self.problems.append(str(error.error)))
        return context

    def _note(self, message: Any) -> None:
        if message.type in LEVELS:
            self.problems.append(f'{message.text} ({message.location["url"]})')


@contextmanager
def visiting(browser: 'Browser', url: str) -> Iterator[Visitor]:
    """Make a visitor; close its pages at the end, and fail if the browser complained."""
    with ExitStack() as stack:
        visitor = Visitor(browser, url, stack)
        yield visitor
    assert not visitor.problems, '\n'.join(visitor.problems)
