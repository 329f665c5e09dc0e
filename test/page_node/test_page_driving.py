"""Who holds what at the page, and what lets go of it: keys, pad, focus, others, a lost server."""

from collections.abc import Iterator
from typing import Any

from playwright.sync_api import Browser, Page
import pytest

from page_helpers import PageStack, visiting, Visitor

WAITING = 30_000
#: Tells what the page asks for, beside doing it.
WATCH = """window.told = [];
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function(data) { window.told.push(data); send.call(this, data); };"""


@pytest.fixture(scope='module')
def page(browser: Browser, page_stack: PageStack) -> Iterator[Page]:
    """Return a page with a robot that is ready, that notes what is sent; one for all tests."""
    with visiting(browser, page_stack.url) as visitor:
        context = visitor.context()
        context.add_init_script(WATCH)
        page = context.new_page()
        page.goto(visitor.url)
        wait_for_robot(page)
        yield page
        # Of connections that are refused every browser complains.
        visitor.problems.clear()


def wait_for_robot(page: Page) -> None:
    """Wait until somebody may drive."""
    page.wait_for_selector('body[data-phase=idle]', timeout=WAITING)


def call(page: Page, module: str, expression: str) -> Any:
    """Return the value of an expression about a module of the page, called `it`."""
    return page.evaluate(f"""import('/{module}').then(it => ({expression}))""")


def test_the_pad_is_straight_near_its_axes_and_full_at_its_edge(page: Page) -> None:
    """What a hand means by ahead is ahead, and nobody has to hit the very edge."""
    moves = call(page, 'drive/pad.js', """[[0, -1], [0.1, -0.9], [0, 0.05], [-0.8, 0], [0, 0.43],
        [0.7, -0.7]].map(([x, y]) => it.moveFromPoint(x, y))""")
    assert moves[:4] == [[1, 0], [1, 0], [0, 0], [0, 1]]
    assert moves[4][0] == pytest.approx(-0.5, abs=0.01)
    assert moves[5] == pytest.approx([0.707, -0.707], abs=0.001)


def test_sides_are_told_as_the_robot_sees_them(page: Page) -> None:
    """What is to the north is on the left of a robot that looks east."""
    assert call(page, 'live/words.js', """[[0, 1, 0], [1, 1, 0], [0, 1, 1.5708], [-1, 0, 0]].map(
        ([x, y, yaw]) => it.sideOf({x: 0, y: 0, yaw}, x, y))""") == [
            'left', 'ahead_left', 'ahead', 'back']


@pytest.mark.parametrize(('keys', 'move'), [
    (['ArrowUp'], [1, 0]), (['u'], [1, 1]), (['m'], [-1, -1]),
    (['ArrowUp', 'ArrowRight'], [1, -1]), (['ArrowUp', 'ArrowDown'], [0, 0])])
def test_keys_drive_together(page: Page, keys: list[str], move: list[int]) -> None:
    """Two arrows are a curve, opposite ones nothing."""
    page.evaluate('window.told.length = 0')
    for key in keys:
        page.keyboard.down(key)
    last = page.evaluate("""window.told.filter(text => text.includes('"v"')).map(JSON.parse)
        .map(({v, w}) => [v, w]).at(-1)""")
    assert last == move
    for key in keys:
        page.keyboard.up(key)


@pytest.mark.parametrize('leave', [
    "window.dispatchEvent(new Event('blur'))",
    """Object.defineProperty(document, 'hidden', {value: true, configurable: true});
       document.dispatchEvent(new Event('visibilitychange'));
       delete document.hidden"""], ids=['another window', 'another tab'])
def test_a_page_that_loses_the_person_lets_go(page: Page, leave: str) -> None:
    """What still is pressed then has to be pressed anew."""
    page.keyboard.down('ArrowLeft')
    page.wait_for_selector('.pad.held')
    page.evaluate(leave)
    page.wait_for_selector('.pad:not(.held)')
    page.keyboard.down('ArrowLeft')
    assert page.locator('.pad.held').count() == 0
    page.keyboard.up('ArrowLeft')


def test_space_stops_whatever_has_the_focus(page: Page) -> None:
    """On a button, a slider or a link it stops and does nothing else; Enter presses."""
    for focused in (
            '[data-action=start]', '.speed input', '#rooms a', '.legend summary', '#language'):
        page.evaluate("document.getElementById('notice').setAttribute('data-done', '')")
        page.focus(focused)
        page.keyboard.press('Space')
        assert page.get_attribute('#notice', 'data-done') == 'stop', focused
        assert page.get_attribute('body', 'data-phase') == 'idle'
    assert not page.locator('.legend').get_attribute('open')
    page.focus('[data-action=start]')
    page.keyboard.press('Enter')
    page.wait_for_selector('[data-action=keep]:focus', timeout=WAITING)
    page.keyboard.press('a')
    wait_for_robot(page)


def test_a_button_that_can_do_nothing_says_why(page: Page) -> None:
    """It can be reached by keys, and nobody is asked for anything."""
    page.evaluate('() => { window.asked = window.fetch; window.fetch = () => Promise.reject(); }')
    page.focus('[data-action=run_trials]')
    page.keyboard.press('Enter')
    assert page.get_attribute('[data-action=run_trials]', 'aria-disabled') == 'true'
    page.wait_for_selector('#notice:not(:empty)')
    page.evaluate('() => { window.fetch = window.asked; }')


def test_one_drives_and_the_other_sees_who(page: Page, visitor: Visitor) -> None:
    """Whoever comes second waits; STOP is obeyed from everybody."""
    other = visitor.open()
    wait_for_robot(other)
    page.bring_to_front()
    page.keyboard.down('ArrowLeft')
    other.wait_for_selector('.driver:not(:empty)', timeout=WAITING)
    assert page.locator('.driver:empty').count() == 1
    other.click('#stop')
    page.keyboard.up('ArrowLeft')
    other.wait_for_selector('.driver:empty', state='attached', timeout=WAITING)


def test_another_language_is_chosen_and_kept(visitor: Visitor) -> None:
    """The first one is the browser's."""
    page = visitor.open(locale='fr-CA')
    page.wait_for_selector('html[lang=fr]', timeout=WAITING)
    page.select_option('#language', 'de')
    page.wait_for_selector('html[lang=de]', timeout=WAITING)
    page.reload()
    page.wait_for_selector('html[lang=de] [data-action=start]:has-text("Los")', timeout=WAITING)


def test_the_map_is_looked_at_closely(page: Page) -> None:
    """By a button, the wheel and the hand; and all of it again."""
    scale = """() => { const {a} = document.querySelector('.live canvas').getContext('2d')
        .getTransform(); return a; }"""
    page.bring_to_front()
    whole = page.evaluate(scale)
    page.click('.zoom button:nth-child(1)')
    page.wait_for_function(f'before => ({scale})() > 1.3 * before', arg=whole, timeout=WAITING)
    page.dblclick('.live canvas')
    page.wait_for_function(f'before => ({scale})() === before', arg=whole, timeout=WAITING)
    page.hover('.live canvas')
    page.mouse.wheel(0, -200)
    page.wait_for_function(f'before => ({scale})() > 1.3 * before', arg=whole, timeout=WAITING)
    page.click('.zoom button:nth-child(3)')
    page.wait_for_function(f'before => ({scale})() === before', arg=whole, timeout=WAITING)


def test_the_page_comes_back_by_itself(page: Page, page_stack: PageStack) -> None:
    """A server that is gone is said on top; what was held has to be pressed anew."""
    page.keyboard.down('ArrowLeft')
    page.wait_for_selector('.pad.held')
    port = page_stack.url.rpartition(':')[2].strip('/')
    page_stack.kill('page_node')
    page.wait_for_selector('body.away', timeout=WAITING)
    assert page.locator('.pad.held').count() == 0
    page_stack.start('page_node', port=int(port))
    page.wait_for_selector('body:not(.away)', timeout=WAITING)
    wait_for_robot(page)
    page.keyboard.up('ArrowLeft')
