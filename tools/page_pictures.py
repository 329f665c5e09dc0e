"""
Take the pictures of the page in ``doc/``, in a real browser that teaches a simulated robot.

``python tools/page_pictures.py`` starts ``experience page``, shows the robot a way by keys as a
person does, lets it try, and goes through the rooms on a phone, a laptop and a projector. It says
how many seconds that took.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import json
import math
import os
from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any, Final

from playwright.sync_api import Browser, Page, sync_playwright, WebSocket

DOC: Final = Path(__file__).resolve().parent.parent / 'doc'
SCREENS: Final = {'phone': (390, 844), 'laptop': (1366, 768), 'projector': (1920, 1080)}
#: What each room shows when it is there.
ROOMS: Final = {'memory': 'li img', 'story': 'figure.curve', 'worlds': '[data-world]'}
#: The way that is shown, [m]: corners; past what stands in the world task1.
WAY: Final = ((1.4, 2.0), (3.9, 2.0), (3.9, 4.1))
#: How near a corner counts as there, [m], and how far off the heading may be, [rad].
NEAR, STRAIGHT = 0.15, 0.12
#: How fast keys drive and turn, [m/s], [rad/s]; for how much of a turn or a way they are held
#: before the next look, and for how long at most, [s].
SPEED, TURN, SHARE, LOOK = 0.2, 1.0, 0.7, 1.0
PATIENCE: Final = 120.0


class Viewer:
    """
    What a page is told, as its own scripts read it.

    Parameters
    ----------
    page : Page
        Before it goes anywhere.

    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.frames: dict[str, Any] = {}
        page.on('websocket', self._watch)

    def _watch(self, socket: WebSocket) -> None:
        socket.on('framereceived', self._note)

    def _note(self, payload: Any) -> None:
        if isinstance(payload, str):
            said = json.loads(payload)
            for frame in said if isinstance(said, list) else [said]:
                self.frames[frame['type']] = frame

    def wait(self, what: str, is_so: Callable[[dict[str, Any]], Any]) -> None:
        """Wait until something is so of the frame `state`."""
        end = time.monotonic() + PATIENCE
        while not is_so(self.frames.get('state', {})):
            if time.monotonic() > end:
                raise SystemExit(f'page_pictures: waited in vain for {what}: '
                                 f'{self.frames.get("state")}')
            self.page.wait_for_timeout(20)


class Keyboard:
    """
    Holds keys, as a person does who looks at the robot.

    Parameters
    ----------
    viewer : Viewer

    """

    def __init__(self, viewer: Viewer) -> None:
        self._viewer, self._page = viewer, viewer.page
        self._held: set[str] = set()

    def hold(self, *keys: str) -> None:
        """Hold these keys and no others."""
        for key in self._held - set(keys):
            self._page.keyboard.up(key)
        for key in set(keys) - self._held:
            self._page.keyboard.down(key)
        self._held = set(keys)

    def go_to(self, x: float, y: float) -> None:
        """Drive to a place: turn there, go on, look again."""
        end = time.monotonic() + PATIENCE
        while True:
            robot = self._viewer.frames['robot']
            if time.monotonic() > end:
                raise SystemExit(f'page_pictures: did not get to {x, y}: {robot}')
            dx, dy = x - robot['x'], y - robot['y']
            if math.hypot(dx, dy) < NEAR:
                break
            off = math.remainder(math.atan2(dy, dx) - robot['yaw'], math.tau)
            turn = [] if abs(off) < STRAIGHT else ['ArrowLeft' if off > 0.0 else 'ArrowRight']
            self.hold(*turn, *(['ArrowUp'] if abs(off) < 4 * STRAIGHT else []))
            # Not to the end: what is seen is a little old.
            self._page.wait_for_timeout(1000.0 * SHARE * min(
                abs(off) / TURN if turn else math.hypot(dx, dy) / SPEED, LOOK))
            if turn:
                self.hold(*self._held - set(turn))
                self._page.wait_for_timeout(100)
        self.hold()


@contextmanager
def running_page(folder: Path, *arguments: str) -> Iterator[str]:
    """Start everything; return the address of the page."""
    command = [sys.executable, '-m', 'experience_cli.main', 'page', '--no-browser', '--bags',
               str(folder / 'bags'), '--out', str(folder), *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            found = re.search(r'https?://\S+', process.stdout.readline())
            assert found, 'it named no address'
            yield found[0]
        finally:
            process.send_signal(signal.SIGINT)


def teach(viewer: Viewer, seconds: Callable[[str], None]) -> None:
    """Show the way, keep it and let the robot try three times."""
    page, keyboard = viewer.page, Keyboard(viewer)
    viewer.wait('the robot', lambda state: state.get('phase') == 'idle' and 'robot'
                in viewer.frames)
    page.keyboard.press('s')
    viewer.wait('the recording', lambda state: state['phase'] == 'demonstration')
    for corner in WAY:
        keyboard.go_to(*corner)
    take(page, 'driving')
    page.keyboard.press('n')
    viewer.wait('what was learnt', lambda state: state['phase'] == 'idle' and state['prototypes'])
    seconds('taught by hand')
    page.keyboard.press('t')
    viewer.wait('the trial', lambda state: state['trial']['steps'] > 12)
    take(page, 'trial')
    viewer.wait('its end', lambda state: state['phase'] == 'idle' and state['trials_left'] == 0
                and state['revision'] > 1)
    seconds('tried')


def take(page: Page, name: str) -> None:
    """Write a picture into ``doc/``."""
    page.wait_for_timeout(300)
    page.screenshot(path=DOC / f'page_{name}.png')


def open_page(browser: Browser, url: str, screen: str, **options: Any) -> Viewer:
    """Open the page on a screen."""
    width, height = SCREENS[screen]
    page = browser.new_page(viewport={'width': width, 'height': height}, locale='en', **options)
    viewer = Viewer(page)
    page.goto(url)
    return viewer


def look_around(browser: Browser, url: str) -> None:
    """Go through the rooms, on every screen."""
    for screen in SCREENS:
        viewer = open_page(browser, url, screen, has_touch=screen == 'phone',
                           color_scheme='dark' if screen == 'projector' else 'light')
        viewer.wait('the page', lambda state: state)
        take(viewer.page, screen)
        if screen == 'laptop':
            for room, shown in ROOMS.items():
                viewer.page.click(f'a[href="#{room}"]')
                viewer.page.wait_for_selector(f'#room-{room} {shown}')
                while not viewer.page.evaluate('[...document.images].every(one => one.complete)'):
                    viewer.page.wait_for_timeout(50)
                take(viewer.page, room)
        viewer.page.close()


def main() -> None:
    """Take all pictures."""
    began = time.monotonic()

    def seconds(what: str) -> None:
        print(f'{what} after {time.monotonic() - began:.1f} s', flush=True)

    executable = shutil.which('chromium')
    if executable is None:
        raise SystemExit("page_pictures: there is no Chromium ('apt install chromium')")
    options = [] if os.getuid() else ['--no-sandbox']
    with (tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright,
          running_page(Path(folder), *sys.argv[1:]) as url):
        browser = playwright.chromium.launch(executable_path=executable, args=options)
        seconds('a browser runs')
        viewer = open_page(browser, url, 'laptop')
        viewer.wait('the page', lambda state: state)
        seconds('the page is there')
        teach(viewer, seconds)
        look_around(browser, url)
        browser.close()


if __name__ == '__main__':
    main()
