"""
The page in a browser: how soon it is of use, what it loads, how often it draws a large field.

``python -m benchmarks.page_drawing`` starts `page_node`, shows it a field of 200 x 200 cells, a
robot that drives through it at 50 Hz and a new field every two seconds, and opens the page in
headless Chromium. A frame is a drawing of the map on the screen. `Of use` is when the newest
sentence, the robot and the field are drawn, by the browser's clock from the request on.
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
import math
from pathlib import Path
import re
import statistics
import tempfile
from threading import Event, Thread
import time
from typing import Any, Final

from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
from playwright.sync_api import Browser, sync_playwright
import rclpy
from sensor_msgs.msg import PointCloud2

from control_field.grid import Grid
from control_field.records import ControlField
from experience_cli.demo.processes import Children, own_domain
from msgs_bridge.messages.neighbourhoods import grid_from_neighbourhood, Neighbourhood
from msgs_bridge.messages.poses import odometry_from_pose, Pose
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.node import qos

_CHROMIUM: Final = '/usr/bin/chromium'
_SIDE: Final = 0.25
_PERIOD: Final = 0.02
_FIELD_PERIOD: Final = 2.0
#: Notes every drawing on a canvas that can be seen, and when the first had a field in it.
_WATCH: Final = """
window.drawn = [];
const drawImage = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function(...all) {
    if (this.canvas.isConnected) window.drawn.push(performance.now());
    else if (all.length === 5) window.hasField ??= performance.now();
    return drawImage.apply(this, all);
};"""
_OF_USE: Final = """() => window.hasField && window.drawn.find(at => at > window.hasField) &&
    Math.max(window.drawn.find(at => at > window.hasField), performance.getEntriesByName(
        'first-contentful-paint')[0]?.startTime ?? 0)"""


def swirling_field(side: int, revision: int) -> ControlField:
    """Return a field of so many cells a side that leads around its middle to its end."""
    grid = Grid(side, side, _SIDE)
    row, col = np.mgrid[:side, :side].astype(np.float32)
    angle = np.arctan2(row - side / 2, col - side / 2) + 1.3 + 0.01 * revision
    known = np.zeros(grid.shape, dtype=np.int8)
    known[(row % 20 == 0) & (col % 7 > 2)] = 100
    known[row + col > 1.8 * side] = -1
    one = np.ones(grid.shape, dtype=np.float32)
    return ControlField(
        grid, revision, (side // 2, side // 2), np.cos(angle).astype(np.float32),
        np.sin(angle).astype(np.float32), one, np.zeros((*grid.shape, 8), dtype=np.float32),
        known, np.full(grid.shape, 8, dtype=np.uint8))


class Robot:
    """A robot that drives in circles, and a learner that learns all the time."""

    def __init__(self, node: Any, side: int) -> None:
        self._node, self._side, self._grid = node, side, Grid(side, side, _SIDE)
        self._odom = node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
        self._local_grid = node.create_publisher(OccupancyGrid, 'neighbourhood', qos.ODOMETRY_PUB)
        self._fields = node.create_publisher(PointCloud2, 'control_field', qos.LATCHED)
        self.is_over = Event()

    def run(self) -> None:
        """Publish until it is over."""
        clouds = [cloud_from_field(swirling_field(self._side, k + 1)) for k in range(2)]
        middle, n_ticks = self._side * _SIDE / 2, 0
        while not self.is_over.wait(_PERIOD):
            if n_ticks % round(_FIELD_PERIOD / _PERIOD) == 0:
                self._fields.publish(clouds[n_ticks // 100 % 2])
            angle = 0.3 * n_ticks * _PERIOD
            self._publish(middle + 0.35 * middle * math.cos(angle),
                          middle + 0.35 * middle * math.sin(angle), angle + math.pi / 2)
            n_ticks += 1

    def _publish(self, x: float, y: float, yaw: float) -> None:
        stamp = self._node.get_clock().now().nanoseconds * 1e-9
        cells = np.zeros((9, 9), dtype=np.int8)
        cells[0] = 100
        self._local_grid.publish(grid_from_neighbourhood(
            Neighbourhood(stamp, *self._grid.cell_from_world(x, y), cells), self._grid))
        self._odom.publish(odometry_from_pose(Pose(stamp, x, y, yaw, v=0.2)))


@contextmanager
def page_with_a_robot(side: int) -> Iterator[str]:
    """Start the page and the robot; return the address."""
    with own_domain() as environment, tempfile.TemporaryDirectory() as folder, Children(
            Path(folder), environment) as children:
        children.start_node('page_node', {'port': 0, 'bags': folder})
        domain = environment.get('ROS_DOMAIN_ID')
        rclpy.init(domain_id=int(domain) if domain else None)
        robot = Robot(rclpy.create_node('robot'), side)
        thread = Thread(target=robot.run)
        thread.start()
        try:
            yield address_in(Path(folder))
        finally:
            robot.is_over.set()
            thread.join()
            rclpy.try_shutdown()


def address_in(folder: Path) -> str:
    """Return the address that the node has printed, once it has."""
    for _ in range(600):
        said = ''.join(path.read_text() for path in folder.iterdir() if path.is_file())
        if found := re.search(r'open (http\S+)', said):
            return found[1]
        time.sleep(0.1)
    raise SystemExit('page_node does not say where it is')


def measure_load(browser: Browser, url: str) -> tuple[float, int]:
    """Return after how long the page is of use, [s], and how many bytes it has loaded by then."""
    context = browser.new_context(viewport={'width': 1366, 'height': 768}, locale='en')
    context.add_init_script(_WATCH)
    page = context.new_page()
    n_bytes = [0]
    devtools = context.new_cdp_session(page)
    devtools.send('Network.enable')
    devtools.on('Network.loadingFinished', lambda event: _add(n_bytes, event['encodedDataLength']))
    devtools.on('Network.webSocketFrameReceived', lambda event: _add(
        n_bytes, len(event['response']['payloadData'])))
    page.goto(url)
    page.wait_for_function(_OF_USE, polling=20)
    seconds = page.evaluate(_OF_USE) / 1000.0
    context.close()
    return seconds, n_bytes[0]


def _add(total: list[int], more: float) -> None:
    total[0] += int(more)


def measure_frames(
    browser: Browser, url: str, viewport: Any, seconds: float,
) -> tuple[float, float]:
    """Return how many frames a second are drawn, and the longest time without one, [s]."""
    context = browser.new_context(viewport=viewport, locale='en')
    context.add_init_script(_WATCH)
    page = context.new_page()
    page.goto(url)
    page.wait_for_function(_OF_USE)
    drawn = page.evaluate("""seconds => new Promise(done => {
        window.drawn.length = 0;
        setTimeout(() => done(window.drawn), 1000 * seconds);
    })""", seconds)
    context.close()
    return len(drawn) / seconds, float(np.diff(drawn).max()) / 1000.0


def tell(title: str, result: str) -> None:
    """Print a line of the table."""
    print(f'{title:42s} {result}', flush=True)


def main(args: list[str] | None = None) -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--side', type=int, default=200, help='cells along a side (200)')
    parser.add_argument('--loads', type=int, default=10, help='how often the page is loaded (10)')
    parser.add_argument('--seconds', type=float, default=10.0, help='how long frames are counted')
    options = parser.parse_args(args)
    with page_with_a_robot(options.side) as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=_CHROMIUM, args=['--no-sandbox'])
        loads = [measure_load(browser, url) for _ in range(options.loads)]
        times = [seconds for seconds, _ in loads]
        tell('of use after',
             f'{statistics.median(times):.2f} s median, {max(times):.2f} s at most')
        tell('loaded by then', f'{max(n for _, n in loads) / 1e6:.2f} MB')
        for width, height in ((390, 844), (1366, 768), (1920, 1080)):
            rate, gap = measure_frames(
                browser, url, {'width': width, 'height': height}, options.seconds)
            tell(f'frames a second at {width} x {height}',
                 f'{rate:.1f}, longest gap {gap:.3f} s')
        browser.close()


if __name__ == '__main__':
    main()
