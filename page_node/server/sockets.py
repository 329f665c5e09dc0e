"""The two sockets of the page: one to drive, one to look."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
import math
import time
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from page_node.driving.drive_watch import DriveWatch
from page_node.exchange import json_bytes, json_object
from page_node.refusal import RefusedError
from page_node.server.view_hub import Viewer, ViewHub

#: Most messages a second that a socket takes, and how many may come at once.
_RATE: Final = 150.0
#: Most messages a second that all of them take who do not drive, before they have to wait.
_SHARED_RATE: Final = 1500.0
#: How long they wait then, [s].
_PAUSE: Final = 0.1
#: Time between two batches for one viewer, and for all of them together, [s].
_BATCH_PERIOD: Final = 1.0 / 30.0
_SHARED_PERIOD: Final = 1.0 / 600.0
#: Time after which who has seen nothing of what was sent is gone, [s].
_PATIENCE: Final = 60.0
#: Most sockets of a kind.
_MOST_SOCKETS: Final = 256
#: How often it is looked who drives, [s].
_DRIVER_PERIOD: Final = 0.1
#: Codes of the protocol: a message that breaks the rules, and no room for another.
_POLICY, _FULL = 1008, 1013


class Allowance:
    """How many messages may still come: so many a second, as many at once."""

    def __init__(self, rate: float) -> None:
        """Start with all of them."""
        self._rate = self._left = rate
        self._at = time.monotonic()

    def spend(self) -> bool:
        """Return whether one more may come."""
        now = time.monotonic()
        self._left = min(self._rate, self._left + self._rate * (now - self._at))
        self._at = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class Reception:
    """Takes messages from many sockets, so that who sends much delays nobody who drives."""

    def __init__(self) -> None:
        """Start with nobody."""
        self._shared = Allowance(_SHARED_RATE)

    async def messages_of(
        self, socket: WebSocket, has_priority: Callable[[], bool] = lambda: False,
    ) -> AsyncIterator[dict[str, Any]]:
        """Yield the objects that come; answer what is none, and close on who sends too many."""
        allowance = Allowance(_RATE)
        while (message := await socket.receive())['type'] != 'websocket.disconnect':
            if not allowance.spend():
                await socket.close(_POLICY, 'too many messages')
                return
            if not (has_priority() or self._shared.spend()):
                await asyncio.sleep(_PAUSE)
            try:
                yield json_object(message.get('text') or message.get('bytes') or '')
            except RefusedError as refusal:
                await tell(socket, {'type': 'error', 'code': refusal.code})


async def tell(socket: WebSocket, value: Any) -> None:
    """Send a value as JSON, if anybody is still there."""
    with suppress(WebSocketDisconnect, RuntimeError):
        await socket.send_text(json_bytes(value).decode())


def share_from_message(message: dict[str, Any]) -> tuple[float, tuple[float, float]]:
    """
    Read a command: when it was sent, [s], and the shares of the speeds.

    Raises
    ------
    RefusedError
        If it is none.

    """
    t, v, w = (message.get(name) for name in 'tvw')
    if set(message) != {'t', 'v', 'w'} or not all(map(_is_number, (t, v, w))):
        raise RefusedError('malformed', 'a command has the numbers t, v and w', 400)
    if max(abs(v), abs(w)) > 1.0:  # type: ignore[arg-type]
        raise RefusedError('out_of_range', 'v and w are from -1 to 1', 400)
    return t / 1000.0, (float(v), float(w))  # type: ignore[operator,arg-type]


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and (
        abs(value) < 1e15 and math.isfinite(value))


class DriveSockets:
    """
    Sockets to drive over; the driving ends with the socket.

    Parameters
    ----------
    watch : DriveWatch
    on_stop : callable
        Called in the server's thread when anybody wants everything to stop.

    """

    def __init__(self, watch: DriveWatch, on_stop: Callable[[], None]) -> None:
        """Start with nobody."""
        self._watch, self._on_stop = watch, on_stop
        self._reception = Reception()
        self._sockets: dict[int, WebSocket] = {}
        self._told: dict[int, str] = {}
        self._telling: dict[int, asyncio.Task[None]] = {}

    async def serve(self, socket: WebSocket) -> None:
        """Take commands until the socket closes."""
        await socket.accept()
        if len(self._sockets) >= _MOST_SOCKETS:
            await socket.close(_FULL, 'too many')
            return
        link = self._watch.join()
        self._sockets[link] = socket
        try:
            self._tell_driver(link, self._watch.driver)
            async for message in self._reception.messages_of(
                    socket, lambda: self._watch.driver == link):
                await self._take(link, socket, message)
        finally:
            self._watch.leave(link)
            self._sockets.pop(link)
            self._told.pop(link, None)
            if telling := self._telling.pop(link, None):
                telling.cancel()

    async def _take(self, link: int, socket: WebSocket, message: dict[str, Any]) -> None:
        if message.get('stop') is True:
            self._watch.halt()
            self._on_stop()
            return
        try:
            sent, share = share_from_message(message)
        except RefusedError as refusal:
            await tell(socket, {'type': 'error', 'code': refusal.code})
            return
        self._watch.command(link, sent, share)

    async def watch_driver(self) -> None:
        """Tell everybody who drives, whenever that changes."""
        while True:
            driver = self._watch.driver
            for link in list(self._sockets):
                self._tell_driver(link, driver)
            await asyncio.sleep(_DRIVER_PERIOD)

    def _tell_driver(self, link: int, driver: int | None) -> None:
        """Tell one of them, without waiting for who does not read."""
        who = 'nobody' if driver is None else 'you' if driver == link else 'other'
        before = self._telling.get(link)
        if self._told.get(link) != who and (before is None or before.done()):
            self._told[link] = who
            self._telling[link] = asyncio.create_task(
                tell(self._sockets[link], {'type': 'driver', 'who': who}))


class ViewSockets:
    """
    Sockets to look through: frames go out as fast as each viewer sees them.

    Parameters
    ----------
    hub : ViewHub

    """

    def __init__(self, hub: ViewHub) -> None:
        """Start with nobody."""
        self._hub = hub
        self._reception = Reception()
        self._viewers: dict[WebSocket, Viewer] = {}

    async def serve(self, socket: WebSocket) -> None:
        """Show what there is until the socket closes."""
        await socket.accept()
        if len(self._viewers) >= _MOST_SOCKETS:
            await socket.close(_FULL, 'too many')
            return
        viewer = self._viewers[socket] = Viewer(self._hub)
        showing = asyncio.create_task(self._show(socket, viewer))
        try:
            await self._listen(socket, viewer)
        finally:
            del self._viewers[socket]
            showing.cancel()

    async def _listen(self, socket: WebSocket, viewer: Viewer) -> None:
        async for message in self._reception.messages_of(socket):
            count = message.get('seen')
            if set(message) != {'seen'} or type(count) is not int or not viewer.see(count):
                await tell(socket, {'type': 'error', 'code': 'malformed'})

    async def _show(self, socket: WebSocket, viewer: Viewer) -> None:
        seen, patient_until = -1, math.inf
        with suppress(WebSocketDisconnect, RuntimeError):
            while socket.application_state is WebSocketState.CONNECTED:
                now = time.monotonic()
                if viewer.is_ready:
                    for message in viewer.messages():
                        await _send(socket, message)
                if viewer.n_seen != seen or viewer.n_seen == viewer.n_sent:
                    seen, patient_until = viewer.n_seen, now + _PATIENCE
                elif now > patient_until:
                    await socket.close(_POLICY, 'nothing was seen')
                await asyncio.sleep(self._period)

    @property
    def is_watched(self) -> bool:
        """Whether somebody sees what is sent; any thread may ask."""
        return any(viewer.is_ready for viewer in list(self._viewers.values()))

    @property
    def _period(self) -> float:
        """Return the time between two batches: all viewers share what the server can do."""
        n_ready = sum(viewer.is_ready for viewer in self._viewers.values())
        return max(_BATCH_PERIOD, n_ready * _SHARED_PERIOD)


async def _send(socket: WebSocket, message: str | bytes) -> None:
    if isinstance(message, str):
        await socket.send_text(message)
    else:
        await socket.send_bytes(message)
