"""Worlds in a real browser: drawn by mouse, finger and keys, brought along, and taught in."""

from http.client import HTTPConnection
import io
import json
from typing import Any
from urllib.parse import urlsplit

from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
from PIL import Image
from playwright.sync_api import Locator, Page
import pytest

from episode_store.episode import Episode
from episode_store.task_folder import TaskFolder
from msgs_bridge.messages.neighbourhoods import occupancy_from_map
from msgs_bridge.messages.poses import pose_from_odometry
from msgs_bridge.node import qos
from page_helpers import PageStack, PHONE, Visitor
from page_node.exchange import MOST_UPLOADED
from page_node.worlds.uploads import MOST_HEADER
import ros_helpers
from world_maps.world import find_world, load_world

WAITING = 30_000
YAML = """image: elsewhere/map.pgm
resolution: 0.25
origin: [0.0, 0.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


@pytest.fixture(scope='module')
def node_changes() -> dict[str, dict[str, object] | None]:
    """Let simulated time pass faster than that of the browser."""
    return {'sim_node': {'speed_factor': 3.0, 'rate': 30.0}}


class Truth:
    """The world as the simulator publishes it, and where the robot is in it."""

    def __init__(self, node: Any) -> None:
        self._node = node
        self._maps = ros_helpers.collect(node, OccupancyGrid, 'map', qos.LATCHED)
        self._odometry = ros_helpers.collect(node, Odometry, 'odom', qos.SENSOR)

    def wait(self, predicate: Any, what: str) -> Any:
        """Wait until something is so."""
        return ros_helpers.wait_until(predicate, node=self._node, what=what)

    @property
    def walls(self) -> set[tuple[int, int]]:
        """Return the pixels that are walls."""
        if not self._maps:
            return set()
        return set(map(tuple, np.argwhere(occupancy_from_map(self._maps[-1])[1]).tolist()))

    @property
    def robot(self) -> tuple[float, float]:
        """Return where the robot was last."""
        self.wait(lambda: self._odometry, 'odometry')
        pose = pose_from_odometry(self._odometry[-1])
        return pose.x, pose.y


@pytest.fixture
def truth(ros_node: Any) -> Truth:
    """Return the simulator's side."""
    return Truth(ros_node)


@pytest.fixture
def page(visitor: Visitor) -> Page:
    """Return the room, with an empty world of 20 x 20 squares to draw on."""
    page = visitor.open('#worlds')
    begin_empty(page)
    return page


def begin_empty(page: Page) -> None:
    """Draw on the empty world that comes with us."""
    page.click('[data-world=open]', timeout=WAITING)
    page.wait_for_selector('[data-world=open][aria-pressed=true]', timeout=WAITING)
    page.click('.tools .clear')


def canvas_of(page: Page) -> Locator:
    return page.locator('.drawing canvas')


def place_of(page: Page, row: float, col: float) -> tuple[float, float]:
    """Return where a square of 20 x 20 is on the screen."""
    box = canvas_of(page).bounding_box()
    assert box is not None
    side = (min(box['width'], box['height']) - 28) / 20
    middle = box['x'] + box['width'] / 2, box['y'] + box['height'] / 2
    return middle[0] + (col + 0.5 - 10) * side, middle[1] - (row + 0.5 - 10) * side


def draw(page: Page, start: tuple[int, int], end: tuple[int, int]) -> None:
    """Draw a line with the mouse."""
    page.mouse.move(*place_of(page, *start))
    page.mouse.down()
    page.mouse.move(*place_of(page, *end), steps=4)
    page.mouse.up()


def use(page: Page, name: str, task: str = '') -> None:
    """Keep it under a name and let the robot be in it, for another task if one is named."""
    page.fill('.use input >> nth=0', name)
    if task:
        page.select_option('.use select', '')
        page.fill('.use label:has-text("new task") input', task)
    page.click('.use .primary')
    page.wait_for_selector('.use [href="#teach"]:visible', timeout=WAITING)


def kept(stack: PageStack, name: str) -> set[tuple[int, int]]:
    """Return the walls of a world that was saved."""
    world = load_world(find_world(str(stack.folder / 'worlds' / f'{name}.yaml')))
    return set(map(tuple, np.argwhere(world.occupancy).tolist()))


def test_what_is_drawn_is_the_world_and_is_taught_in_at_once(
    page: Page, page_stack: PageStack, truth: Truth, visitor: Visitor,
) -> None:
    """A wall on the robot sets it free, all pages show it, and a drive is of the new task."""
    draw(page, (3, 2), (3, 6))
    draw(page, (8, 4), (12, 4))
    page.click('.tools .undo')
    draw(page, (10, 10), (10, 13))
    page.click('label:has([value=erase])')
    draw(page, (10, 12), (10, 12))
    walls = {(3, c) for c in range(2, 7)} | {(10, 10), (10, 11), (10, 13)}
    before = truth.robot
    other = visitor.open('#worlds', viewport=PHONE)
    other.wait_for_selector('[data-world=open] small', timeout=WAITING)
    use(page, 'my hall', 'hall')
    other.wait_for_selector('[data-world=my_hall] small', timeout=WAITING)
    assert kept(page_stack, 'my_hall') == walls
    truth.wait(lambda: truth.walls == walls, 'the walls')
    truth.wait(lambda: truth.robot != before, 'the robot in free space')
    page.wait_for_selector('#notice:has-text("free space")', timeout=WAITING)
    assert page.get_attribute('[data-world=my_hall]', 'aria-pressed') == 'true'

    page.click('.use [href="#teach"]')
    page.click('[data-action=start]', timeout=WAITING)
    page.wait_for_selector('body[data-phase=demonstration]', timeout=WAITING)
    page.click('nav a[href="#worlds"]')
    page.click('.use .primary')
    page.wait_for_selector('#notice:has-text("still going on")', timeout=WAITING)
    page.click('nav a[href="#teach"]')
    x, y = truth.robot
    page.keyboard.down('ArrowUp')
    truth.wait(lambda: np.hypot(truth.robot[0] - x, truth.robot[1] - y) > 0.6, 'the way')
    page.keyboard.up('ArrowUp')
    page.click('[data-action=keep]')
    page.wait_for_selector('.run_trials.primary', timeout=WAITING)
    [episode] = TaskFolder(page_stack.bags, 'hall').episodes()
    assert Episode(episode).header.task == 'hall'
    assert not (page_stack.bags / 'task').exists()


def test_a_finger_draws_and_two_look_closer(visitor: Visitor, page_stack: PageStack) -> None:
    """On a phone; what the first of two fingers has drawn is taken back."""
    page = visitor.open('#worlds', viewport=PHONE, has_touch=True)
    begin_empty(page)
    canvas_of(page).scroll_into_view_if_needed()
    devtools = page.context.new_cdp_session(page)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        devtools.send('Input.dispatchTouchEvent', {'type': kind, 'touchPoints': [
            {'x': x, 'y': y, 'id': finger} for finger, (x, y) in enumerate(places)]})

    one, other = place_of(page, 15, 5), place_of(page, 15, 9)
    touch('touchStart', one)
    touch('touchMove', other)
    touch('touchEnd')
    touch('touchStart', place_of(page, 12, 5))
    touch('touchStart', place_of(page, 12, 5), place_of(page, 12, 8))
    touch('touchMove', place_of(page, 12, 3), place_of(page, 12, 12))
    touch('touchEnd')
    page.fill('.use input >> nth=0', 'by_finger')
    page.tap('.use .save')
    page.wait_for_selector('[data-world=by_finger]', timeout=WAITING)
    assert kept(page_stack, 'by_finger') == {(15, c) for c in range(5, 10)}
    assert page.evaluate('document.documentElement.scrollWidth') <= PHONE['width']


def test_keys_alone_draw_and_hear_what_is_there(page: Page, page_stack: PageStack) -> None:
    """Arrows move the pen, Enter and shift draw, and what is under the pen is said."""
    page.focus('.tools .clear')
    page.keyboard.press('Tab')
    assert page.evaluate('document.activeElement.tagName') == 'CANVAS'
    for key in ('ArrowUp', 'ArrowLeft', 'Enter', 'ArrowUp', 'Shift+ArrowRight'):
        page.keyboard.press(key)
    page.wait_for_selector('text=Wall at 2.63 m, 3.13 m.', state='attached', timeout=WAITING)
    page.keyboard.press('ArrowUp')
    page.wait_for_selector('text=Free at 2.63 m, 3.38 m.', state='attached', timeout=WAITING)
    page.fill('.use input >> nth=0', 'by_keys')
    page.press('.use .save', 'Enter')
    page.wait_for_selector('[data-world=by_keys]', timeout=WAITING)
    assert kept(page_stack, 'by_keys') == {(11, 9), (12, 9), (12, 10)}


def test_a_picture_and_a_map_of_map_server_are_taken(
    page: Page, page_stack: PageStack, truth: Truth, visitor: Visitor,
) -> None:
    """A PNG gets the scale that is given, a map the one in its YAML file."""
    pixels = np.full((12, 16), 255, np.uint8)
    pixels[0, 0] = 0
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, 'png')
    page.click('text=Bring a map')
    for name, files in (
            ('Kuche', [('Küche.png', file.getvalue())]),
            ('map', [('map.yaml', YAML.encode()),
                     ('map.pgm', b'P5\n16 12\n255\n' + pixels.tobytes())])):
        if not page.is_visible('input[type=file]'):
            page.click('text=Bring a map')
        page.set_input_files('input[type=file]', [
            {'name': each, 'mimeType': '', 'buffer': content} for each, content in files])
        page.fill('label:has-text("Metres a pixel") input', '0.25')
        page.click('text=Take it')
        page.wait_for_selector(f'[data-world={name}][aria-pressed=true]', timeout=WAITING)
        assert kept(page_stack, name) == {(11, 0)}
    page.click('.use .primary')
    page.wait_for_selector('.use [href="#teach"]:visible', timeout=WAITING)
    truth.wait(lambda: truth.walls == {(11, 0)}, 'the map')
    page.set_input_files('input[type=file]', [
        {'name': 'notes.txt', 'mimeType': '', 'buffer': b'no picture'}])
    page.click('text=Bring a map')
    page.click('text=Take it')
    page.wait_for_selector('#notice:has-text("no map that can be read")', timeout=WAITING)
    assert all('400' in problem for problem in visitor.problems)
    visitor.problems.clear()  # of what was refused


def test_another_task_is_begun_where_it_is_taught(visitor: Visitor) -> None:
    """A name that is none is mended; one that is nearly another's is meant so."""
    page = visitor.open()
    page.click('.task-choice summary', timeout=WAITING)
    page.select_option('.task-choice select', '')
    page.fill('.task-choice input', 'Ma cuisine à moi')
    page.click('.task-choice button')
    page.wait_for_selector('.task-choice summary:has-text("Ma_cuisine_a_moi")', timeout=WAITING)
    page.wait_for_selector('#notice:has-text("Ma_cuisine_a_moi")', timeout=WAITING)


@pytest.mark.parametrize(('path', 'body', 'code'), [
    ('worlds/..%2F..%2Fx', b'x', 'malformed'), ('worlds/.x', b'x', 'bad_name'),
    ('worlds/x', b'x', 'malformed'), ('worlds/task1', b'x', 'shipped'),
    ('worlds/x', bytes(MOST_UPLOADED + 2 * MOST_HEADER), 'too_big'),
    ('worlds/none/use', b'{}', 'no_world'),
    ('worlds/open/use', b'[]', 'malformed'), ('worlds/open/use', b'{"task": 7}', 'malformed'),
    ('worlds/open/use', b'{"task": "../x"}', 'task_refused'),
    ('tasks/..x/use', b'{}', 'task_refused'), ('tasks/x/use', b'{"task": "y"}', 'malformed')])
def test_what_no_page_of_ours_sends_is_refused(
    page_stack: PageStack, path: str, body: bytes, code: str,
) -> None:
    """Names that lead out, bodies that are no worlds or too big, tasks that are no names."""
    address = urlsplit(page_stack.url)
    connection = HTTPConnection(str(address.hostname), address.port or 80, timeout=60)
    connection.request('POST', f'/api/{path}', headers={
        'Origin': f'http://{address.netloc}', 'Content-Type': 'application/octet-stream',
        'Content-Length': str(len(body))}, body=body if len(body) <= MOST_UPLOADED else b'')
    answer = json.loads(connection.getresponse().read())
    connection.close()
    assert answer['code'] == code
    assert not list(page_stack.folder.glob('x*'))
