"""A page by itself: where it is, how others get at it, and who hears what is driven there."""

from collections.abc import Iterator
from contextlib import contextmanager
import json
from pathlib import Path
import re
import time
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from geometry_msgs.msg import Twist
from websockets.sync.client import connect

from msgs_bridge.messages.velocities import velocity_from_twist
from page_node.driving.dead_man import RESERVED
import ros_helpers

AHEAD = {'v': 0.5, 'w': 0.0}
STANDING = {'v': 0.0, 'w': 0.0}
#: What half of the speed of the settings is, [m/s].
SPEED = (0.1, 0.0)
STANDSTILL = (0.0, 0.0)


@contextmanager
def running_site(
    folder: Path, domain: int, **parameters: object,
) -> Iterator[tuple[ros_helpers.Process, str]]:
    """Start the node; yield it and where it is."""
    with ros_helpers.start_node('page_node.node', folder, {'port': 0, **parameters},
                                env={'ROS_DOMAIN_ID': str(domain)}) as process:
        found = ros_helpers.wait_until(
            lambda: re.search(r'http://\S+', process.stdout), processes=[process])
        yield process, found[0]


class Site:
    """Where the page is, and how others get at it."""

    def __init__(self, process, url, token=''):
        self.process, self.url, self.token = process, url, token
        self.host = url.split('/')[2]

    def socket(self, path, origin=None, **options):
        return connect(f'ws://{self.host}{path}', origin=origin or f'http://{self.host}',
                       **options)

    def get(self, path='', **headers):
        return self.ask(Request(self.url + path, headers=headers))

    @staticmethod
    def ask(request):
        """Return status, body and headers."""
        try:
            with urlopen(request, timeout=ros_helpers.DEADLINE) as answer:
                return answer.status, answer.read(), answer.headers
        except HTTPError as error:
            return error.code, error.read(), error.headers


class Robot:
    """Hears commands, with the time they came."""

    def __init__(self, node, process):
        self.node, self.process, self.heard = node, process, []
        node.create_subscription(Twist, 'cmd_vel_teleop', self._hear, 50)

    def wait_for_silence(self):
        """Wait until nothing has come for a while."""
        end = time.monotonic() + RESERVED
        while time.monotonic() < end:
            ros_helpers.spin_some(self.node)
            if self.heard:
                end = time.monotonic() + RESERVED
                self.heard.clear()

    def _hear(self, msg):
        self.heard.append((time.monotonic(), velocity_from_twist(msg)))

    def wait(self, predicate, what):
        return ros_helpers.wait_until(
            predicate, node=self.node, processes=[self.process], what=what)

    def moves(self):
        return bool(self.heard) and self.heard[-1][1] == SPEED

    def stands(self):
        return bool(self.heard) and self.heard[-1][1] == STANDSTILL

    def drive_by(self, drive):
        """Hold ahead until it moves."""
        self.wait(lambda: command(drive, AHEAD) or self.moves(), 'the movement')


def tell(websocket, message):
    websocket.send(json.dumps(message))


def command(websocket, share, age=0.0):
    tell(websocket, {'t': 1000.0 * (time.monotonic() - age), **share})
