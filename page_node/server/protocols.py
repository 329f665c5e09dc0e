"""The protocols of uvicorn, for peers that may be slow, silent or many."""

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

#: Most connections; one on top is closed at once.
MOST_CONNECTIONS: Final = 600
#: How long a connection may take to ask for something, and a peer to close its socket, too, [s].
_PATIENCE: Final = 10.0
_FAREWELL: Final = 0.3
#: Most bytes that are read of a socket at once. All messages in them are taken apart before
#: anybody else is served, and a message may have as few as six bytes.
_MOST_READ: Final = 1024


class PatientHttp(H11Protocol):
    """HTTP, for a while: who connects and asks for nothing is in the way of others."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request."""
        super().connection_made(transport)
        if len(self.connections) > MOST_CONNECTIONS:
            transport.abort()
            return
        self._waiting = self.loop.call_later(_PATIENCE, self._give_up)

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        super().connection_lost(exc)
        self._stop_waiting()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Wait no longer: from now on it is a socket."""
        self._stop_waiting()
        super().handle_websocket_upgrade(event)

    def _stop_waiting(self) -> None:
        if hasattr(self, '_waiting'):
            self._waiting.cancel()

    def _give_up(self) -> None:
        if self.cycle is None:
            self.transport.abort()


class BriskSocket(WebSocketsSansIOProtocol):
    """A socket whose peer is let go of if it does not read any more."""

    def connection_made(self, transport: Any) -> None:
        """Read a little at a time."""
        super().connection_made(transport)
        transport.max_size = _MOST_READ

    def keepalive_timeout(self) -> None:
        """Close what answers no ping, without waiting until it has read what is on its way."""
        super().keepalive_timeout()
        self.transport.abort()

    async def send(self, message: Any) -> None:
        """Send; a socket that is closed may wait for its peer, but not for ever."""
        await super().send(message)
        if message['type'] == 'websocket.close':
            self.loop.call_later(_FAREWELL, self.transport.abort)
