"""The web server in a thread of its own."""

from collections.abc import Callable
import socket
from threading import Event, Thread
from typing import Any, Final

import uvicorn

from page_node.server.protocols import BriskSocket, MOST_CONNECTIONS, PatientHttp

#: Greatest message on a socket, [bytes].
MOST_IN_MESSAGE: Final = 65_536
#: Time after which a socket that answers no ping is closed, and a request without a second one.
_PING_PERIOD: Final = 5.0
_KEEP_ALIVE: Final = 15
#: How long connections may take to end with the server, [s].
_FAREWELL: Final = 1


def listen(host: str, port: int) -> socket.socket:
    """
    Return a socket that listens.

    Raises
    ------
    ValueError
        If that is not possible: one line that says why and what to do.

    """
    try:
        family, _, _, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        return socket.create_server(address[:2], family=family, backlog=128)
    except OSError as error:
        hint = ('another page_node or another program listens there: end it, or give another '
                'one, -p port:=...; port:=0 takes any' if error.errno == 98 else
                'give another one, -p host:=... -p port:=...')
        raise ValueError(f'cannot listen on {host} port {port}: {error.strerror}; {hint}'
                         ) from None


def address_of(listener: socket.socket, token: str) -> str:
    """Return the address to open in a browser."""
    host, port = listener.getsockname()[:2]
    if host in ('0.0.0.0', '::'):  # noqa: S104 - read, not bound
        host = socket.gethostname()
    name = f'[{host}]' if ':' in host else host
    return f'http://{name}:{port}/' + (f'?token={token}' if token else '')


class WebServer:
    """
    Runs an application in a thread with an event loop of its own.

    Parameters
    ----------
    listener : socket
        Where it listens.
    make_app : callable
        Returns the application; gets what that has to call in the event loop at its start.

    """

    def __init__(
        self, listener: socket.socket, make_app: Callable[[Callable[[], None]], Any],
    ) -> None:
        """Prepare; `start` starts the thread."""
        self._listener, self._started = listener, Event()
        self._server = uvicorn.Server(uvicorn.Config(
            make_app(self._started.set), http=PatientHttp, ws=BriskSocket,
            ws_max_size=MOST_IN_MESSAGE,
            ws_per_message_deflate=False, ws_ping_interval=_PING_PERIOD,
            ws_ping_timeout=_PING_PERIOD, limit_concurrency=MOST_CONNECTIONS,
            timeout_keep_alive=_KEEP_ALIVE, timeout_graceful_shutdown=_FAREWELL,
            h11_max_incomplete_event_size=MOST_IN_MESSAGE, proxy_headers=False,
            server_header=False, access_log=False, log_config=None, log_level='critical',
            loop='asyncio'))
        self._thread = Thread(target=self._run, name='web_server', daemon=True)

    @property
    def is_running(self) -> bool:
        """Whether its thread works."""
        return self._thread.is_alive()

    def start(self) -> None:
        """Start the thread, and return once somebody is served."""
        self._thread.start()
        self._started.wait()

    def close(self) -> None:
        """Say good-bye to whoever is connected, and end the thread."""
        self._server.should_exit = True
        if self._thread.is_alive():
            self._thread.join()
        self._listener.close()

    def _run(self) -> None:
        try:
            self._server.run(sockets=[self._listener])
        finally:
            self._started.set()
