"""
A second door for those who have Foxglove: what nodes publish, as it is, to be looked at.

It is open only where it is asked for (`foxglove_port`), on this machine alone, and nothing that
comes in through it is heeded. Its server asks nobody who they are: any page in a browser of this
machine could look, too, as `doc/security.md` says.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from episode_store.rosbag2.type_definitions import message_definition
from msgs_bridge.node import qos

#: Whoever is not on this machine comes through the page, which asks for a token.
HOST: Final = '127.0.0.1'
#: Messages that wait for a slow viewer; the oldest go first.
_BACKLOG: Final = 64
#: What is shown: topic, type, and how it is read.
TOPICS: Final[tuple[tuple[str, Any, Any], ...]] = (
    ('odom', Odometry, qos.SENSOR), ('neighbourhood', OccupancyGrid, qos.SENSOR),
    ('map', OccupancyGrid, qos.LATCHED), ('movers', MarkerArray, qos.LATCHED),
    ('markers', MarkerArray, qos.LATCHED), ('control_field', PointCloud2, qos.LATCHED),
    ('prototypes', PointCloud2, qos.LATCHED), ('experience', PointCloud2, qos.EXPERIENCE),
    ('trial', DiagnosticStatus, qos.LATCHED), ('/diagnostics', DiagnosticArray, 10))


class FoxgloveDoor:
    """
    Serves messages in the bytes that they arrive in.

    Parameters
    ----------
    port : int
        0 for any free one.

    Raises
    ------
    ValueError
        If the library is not installed, or the port taken: one line that says what to do.

    """

    def __init__(self, port: int) -> None:
        try:
            self._sdk: Any = import_module('foxglove')
        except ImportError:
            raise ValueError(
                'foxglove_port: foxglove-sdk is not installed; get it with `pip install '
                'foxglove-sdk`, or leave foxglove_port out') from None
        self._context = self._sdk.Context()
        #: By the number of a channel: how it is sent, and its newest message if that still holds.
        self._latched: dict[int, tuple[Callable[[bytes], None], list[bytes]]] = {}
        try:
            self._server = self._sdk.start_server(
                name='experience_controller', host=HOST, port=port, context=self._context,
                message_backlog_size=_BACKLOG, server_listener=_listener(self._on_subscribe))
        except Exception as error:
            raise ValueError(f'foxglove_port is {port}: cannot listen there ({error}); give '
                             f'another one') from None

    @property
    def address(self) -> str:
        """Return what to open in Foxglove: *Open connection*, *Foxglove WebSocket*."""
        return f'ws://{HOST}:{self._server.port}'

    def channel(
        self, topic: str, type_name: str, is_latched: bool = False,
    ) -> Callable[[bytes], None]:
        """
        Announce a topic; return what its messages are given to, in CDR.

        Of a latched one whoever comes later gets the newest message, as in ROS.
        """
        schema = self._sdk.Schema(
            name=type_name, encoding='ros2msg', data=message_definition(type_name).encode())
        channel = self._sdk.Channel(
            topic, schema=schema, message_encoding='cdr', context=self._context)
        log: Callable[[bytes], None] = channel.log
        if not is_latched:
            return log
        newest: list[bytes] = []
        self._latched[channel.id()] = log, newest

        def keep_and_log(cdr: bytes) -> None:
            newest[:] = [cdr]
            log(cdr)

        return keep_and_log

    def _on_subscribe(self, channel_id: int) -> None:
        """Tell again what still holds; in a thread of the server."""
        log, newest = self._latched.get(channel_id, (None, ()))
        for cdr in newest:
            if log is not None:
                log(cdr)

    def close(self) -> None:
        """Say good-bye to whoever looks."""
        self._server.stop()


def open_door(node: Any, port: int) -> FoxgloveDoor:
    """Open it for what is published around a node, which reads that without unpacking it."""
    door = FoxgloveDoor(port)
    for name, kind, profile in TOPICS:
        type_name = f'{kind.__module__.partition(".")[0]}/msg/{kind.__name__}'
        take = door.channel(
            node.resolve_topic_name(name), type_name, is_latched=profile is qos.LATCHED)
        node.create_subscription(kind, name, take, profile, raw=True)
    return door


def _listener(on_subscribe: Callable[[int], None]) -> Any:
    """Return what the server tells of its viewers; it asks for a class of its own."""
    base: Any = import_module('foxglove.websocket').ServerListener

    class Listener(base):  # type: ignore[misc, unused-ignore]
        def on_subscribe(self, client: Any, channel: Any) -> None:
            on_subscribe(channel.id)

    return Listener()
