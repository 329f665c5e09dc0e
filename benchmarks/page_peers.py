"""
Others around a page, each a process: ``python -m benchmarks.page_peers hear|view|rubbish ...``.

`hear` writes a line for each command and each odometry: when it came by the steady clock and by
that of the wall, from which topic, and the speeds. `view` looks at a page with several sockets,
and writes how many messages a second each got. `rubbish` sends it with as many what is no command.
"""

import asyncio
from contextlib import suppress
from functools import partial
import json
from pathlib import Path
import sys
import time
from typing import Any, Final

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
import rclpy
from rclpy.node import Node
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin

from msgs_bridge.messages.velocities import velocity_from_twist
from msgs_bridge.node import qos

TOPICS: Final = ('cmd_vel_teleop', 'cmd_vel')


def hear(path: str) -> None:
    """Write what is heard into a file until the end."""
    rclpy.init(args=[])
    node: Any = Node('page_listener')
    with Path(path).open('w', buffering=1) as file:
        for topic in TOPICS:
            node.create_subscription(Twist, topic, partial(_write, file, topic), 50)
        node.create_subscription(Odometry, 'odom', lambda msg: _write(
            file, 'odom', msg.twist), qos.SENSOR)
        rclpy.spin(node)


def _write(file: Any, topic: str, msg: Any) -> None:
    steady, wall = time.monotonic(), time.time()
    v, w = velocity_from_twist(msg)
    file.write(f'{steady!r} {wall!r} {topic} {v!r} {w!r}\n')


def view(url: str, n_viewers: str) -> None:
    """Look with so many sockets until the end, and write the messages a second of each."""
    asyncio.run(_view(url, int(n_viewers)))


async def _view(url: str, n_viewers: int) -> None:
    counts = [0] * n_viewers
    sockets = [await connect(url.replace('http', 'ws', 1) + 'view', origin=Origin(url.rstrip('/')),
                             max_size=None) for _ in range(n_viewers)]
    watching = [asyncio.create_task(_see(socket, counts, n)) for n, socket in enumerate(sockets)]
    while not any(task.done() for task in watching):
        before = list(counts)
        await asyncio.sleep(2.0)
        print(*(f'{(now - then) / 2.0:.1f}' for then, now in zip(before, counts, strict=True)),
              flush=True)


async def _see(socket: ClientConnection, counts: list[int], n: int) -> None:
    async for _ in socket:
        counts[n] += 1
        await socket.send(json.dumps({'seen': counts[n]}))


def rubbish(url: str, n_sockets: str) -> None:
    """Send with so many sockets to drive what is no command, 20 times a second, to the end."""
    asyncio.run(_send_rubbish(url, int(n_sockets)))


async def _send_rubbish(url: str, n_sockets: int) -> None:
    sockets = [await connect(url.replace('http', 'ws', 1) + 'drive',
                             origin=Origin(url.rstrip('/'))) for _ in range(n_sockets)]
    print('all there', flush=True)
    while True:
        for socket in sockets:
            with suppress(ConnectionClosed):  # it never reads what it is answered
                await socket.send('{"t": 1, "v": "x"}')
        await asyncio.sleep(0.05)


if __name__ == '__main__':
    globals()[sys.argv[1]](*sys.argv[2:])
