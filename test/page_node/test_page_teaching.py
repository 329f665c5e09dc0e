"""Teach, redo, keep, try, correct, undo: by mouse, keys, touch and gamepad, on real nodes."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
from typing import Any

from nav_msgs.msg import Odometry
from playwright.sync_api import Page
import pytest

from page_helpers import PHONE, Visitor
from ros_helpers import wait_until

KEYS = {'ahead': 'ArrowUp', 'left': 'ArrowLeft'}
#: Buttons of a standard gamepad, A, B, X, Y and Back, and how to push its left stick.
A, B, X, Y, BACK = 0, 1, 2, 3, 8
BUTTONS = {'start': A, 'keep': A, 'redo': Y, 'run_trials': X, 'undo': BACK}
AXES = {'ahead': (1, -1.0), 'left': (0, -1.0)}
#: Way that is shown, [m].
WAY = 1.2
WAITING = 30_000


@pytest.fixture(scope='module')
def node_changes() -> dict[str, dict[str, object] | None]:
    """Let simulated time pass faster than that of the browser."""
    return {'sim_node': {'speed_factor': 3.0, 'rate': 30.0}}


class Person:
    """Somebody at the page; how they press and hold is what differs."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def press(self, action: str) -> None:
        """Press the button of an action."""
        raise NotImplementedError

    def choose_many(self) -> None:
        """Choose many tries, one after the other."""
        self.page.click('.series label:last-of-type')

    def stop(self) -> None:
        """Stop the robot."""
        self.page.click('#stop')

    @contextmanager
    def holding(self, direction: str) -> Iterator[None]:
        """Hold `ahead` or `left` meanwhile."""
        raise NotImplementedError
        yield


class Mouse(Person):
    """A pointer with one button."""

    def press(self, action: str) -> None:
        self.page.click(f'[data-action={action}]')

    @contextmanager
    def holding(self, direction: str) -> Iterator[None]:
        self.page.hover(f'.pad .{direction}')
        self.page.mouse.down()
        yield
        self.page.mouse.up()


class Keyboard(Person):
    """Keys alone: letters for what there is one for, as the buttons show them."""

    def press(self, action: str) -> None:
        button = self.page.locator(f'[data-action={action}]')
        self.page.keyboard.press(button.get_attribute('aria-keyshortcuts') or '')

    def choose_many(self) -> None:
        self.page.focus('.series input')
        self.page.keyboard.press('ArrowLeft')

    def stop(self) -> None:
        self.page.keyboard.press('Space')

    @contextmanager
    def holding(self, direction: str) -> Iterator[None]:
        self.page.keyboard.down(KEYS[direction])
        yield
        self.page.keyboard.up(KEYS[direction])


class Touch(Person):
    """A finger on a phone."""

    def press(self, action: str) -> None:
        self.page.tap(f'[data-action={action}]')

    def choose_many(self) -> None:
        self.page.tap('.series label:last-of-type')

    def stop(self) -> None:
        self.page.tap('#stop')

    @contextmanager
    def holding(self, direction: str) -> Iterator[None]:
        box = self.page.locator(f'.pad .{direction}').bounding_box()
        assert box is not None
        point = {'x': box['x'] + box['width'] / 2, 'y': box['y'] + box['height'] / 2}
        devtools = self.page.context.new_cdp_session(self.page)
        self._touch(devtools, 'touchStart', [point])
        yield
        self._touch(devtools, 'touchEnd', [])
        devtools.detach()

    def _touch(self, devtools: Any, kind: str, points: list[dict[str, float]]) -> None:
        devtools.send('Input.dispatchTouchEvent', {'type': kind, 'touchPoints': points})


class Gamepad(Person):
    """A gamepad that the browser is made to believe in; buttons it has none for are clicked."""

    FAKE = """window.fake = {axes: [0, 0, 0, 0],
        buttons: Array.from({length: 17}, () => ({pressed: false, value: 0}))};
        navigator.getGamepads = () => [window.fake, null, null, null];"""

    def press(self, action: str) -> None:
        if action not in BUTTONS:
            self.page.click(f'[data-action={action}]')
        else:
            self._push_button(BUTTONS[action])

    def stop(self) -> None:
        self._push_button(B)

    def _push_button(self, index: int) -> None:
        # Held until it was looked at.
        self.page.evaluate("""async ([index]) => {
            const wait = ms => new Promise(done => setTimeout(done, ms));
            window.fake.buttons[index].pressed = true;
            await wait(100);
            window.fake.buttons[index].pressed = false;
            await wait(100);
        }""", [index])

    @contextmanager
    def holding(self, direction: str) -> Iterator[None]:
        index, value = AXES[direction]
        self._push(index, value)
        yield
        self._push(index, 0.0)

    def _push(self, index: int, value: float) -> None:
        self.page.evaluate('([index, value]) => { window.fake.axes[index] = value; }',
                           [index, value])


def correct(person: Person) -> None:
    """Drive in the middle of a trial, of this one or, where it ends too soon, of the next."""
    while True:
        person.page.wait_for_selector('body[data-trial=running]', timeout=WAITING)
        with person.holding('left'):
            person.page.wait_for_selector('body:not([data-trial=running])', timeout=WAITING)
            if person.page.get_attribute('body', 'data-trial') == 'paused':
                return


class Robot:
    """Where the robot is, by its odometry."""

    def __init__(self, node: Any) -> None:
        self._node = node
        self.place = (math.nan, math.nan)
        self._subscription = node.create_subscription(Odometry, 'odom', self._on_odometry, 10)

    def _on_odometry(self, msg: Odometry) -> None:
        position = msg.pose.pose.position
        self.place = position.x, position.y

    def wait(self, there: Callable[[], bool], what: str) -> None:
        """Wait until something is so."""
        wait_until(there, node=self._node, what=what)

    def wait_to_move(self, distance: float) -> None:
        """Wait until it has gone as far from where it is."""
        self.wait(lambda: math.isfinite(self.place[0]), 'odometry')
        began = self.place
        self.wait(lambda: math.dist(self.place, began) > distance, 'the robot to move')


def open_for(kind: type[Person], visitor: Visitor) -> Person:
    """Open the page as this person has it."""
    context = visitor.context(**({'viewport': PHONE, 'has_touch': True} if kind is Touch else {}))
    if kind is Gamepad:
        context.add_init_script(Gamepad.FAKE)
    page = context.new_page()
    page.goto(visitor.url)
    return kind(page)


def wait_for_done(page: Page, action: str) -> None:
    """Wait until the page says that an action has been done."""
    page.wait_for_selector(f'#notice[data-done={action}]', state='attached', timeout=WAITING)


def wait_for_phase(page: Page, phase: str) -> None:
    """Wait until the learner is at something."""
    page.wait_for_selector(f'body[data-phase={phase}]', timeout=WAITING)


def press(person: Person, action: str) -> None:
    """Press a button once it can do something: keys do not wait for that as clicks do."""
    person.page.wait_for_selector(
        f'[data-action={action}][aria-disabled=false]', timeout=WAITING)
    person.press(action)


@pytest.mark.parametrize('kind', [Mouse, Keyboard, Touch, Gamepad])
def test_a_robot_is_taught_without_a_terminal(
    kind: type[Person], visitor: Visitor, ros_node: Any,
) -> None:
    """Start, redo, keep, try, correct in the middle of it, judge, remove and undo."""
    person, robot = open_for(kind, visitor), Robot(ros_node)
    page = person.page
    wait_for_phase(page, 'idle')
    press(person, 'set_back')
    wait_for_done(page, 'set_back')
    press(person, 'start')
    wait_for_done(page, 'start')
    with person.holding('left'):
        page.wait_for_selector('.pad.held')
    press(person, 'redo')
    wait_for_done(page, 'redo')
    with person.holding('ahead'):
        robot.wait_to_move(WAY)
    press(person, 'keep')
    wait_for_done(page, 'keep')
    person.choose_many()
    press(person, 'run_trials')
    correct(person)
    person.stop()
    page.wait_for_selector('.told[data-outcome=stopped]', timeout=WAITING)
    wait_for_phase(page, 'idle')
    for action in ('label_success', 'drop_last', 'undo'):
        press(person, action)
        wait_for_done(page, action)
