"""What becomes of the robot when the browser that drives it is gone; needs playwright."""

import signal

import pytest

from benchmarks.page_bench import Chromium


@pytest.fixture
def browser(page_site, robot):
    """Return a browser of its own that has the page open and drives ahead."""
    with Chromium(page_site.url) as chromium:
        chromium.page.wait_for_selector('#dock button')
        chromium.page.keyboard.down('ArrowUp')
        robot.wait(lambda: robot.heard and not robot.stands(), 'the movement')
        yield chromium


@pytest.mark.parametrize(('number', 'kind'), [
    (signal.SIGKILL, ''), (signal.SIGSTOP, 'renderer')], ids=['killed', 'tab frozen'])
def test_the_robot_stands_and_nothing_moves_it_again(robot, browser, number, kind):
    browser.send(number, kind)
    robot.wait(robot.stands, 'the standstill')
    robot.wait_for_silence()
