"""Where the browser for the tests of the page is, and what happens without one."""

from importlib.util import find_spec
import os
import shutil

#: Names under which Chromium, or a browser made of it, is installed.
NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
#: Set where a test without a browser has to fail.
REQUIRED = 'EXPERIENCE_SKIP_NOTHING'
HOW_TO_GET_ONE = ("no Chromium for the tests of the page; get one: 'apt install chromium' (and, "
                  "outside of 'make test', 'pip install playwright axe-playwright-python')")


def chromium() -> str | None:
    """Return the path of the browser, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def are_left_out() -> bool:
    """Return whether tests that need a browser are left out."""
    is_there = chromium() is not None and find_spec('playwright') is not None
    return not is_there and not os.environ.get(REQUIRED)
