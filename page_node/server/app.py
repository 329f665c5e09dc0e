"""What the server answers: files, endpoints of the rooms, two sockets, all behind the guard."""

import asyncio
from asyncio import Semaphore
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request as Incoming
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles

from page_node.exchange import Endpoint, MOST_BYTES, Request
from page_node.refusal import RefusedError
from page_node.server.guard import AccessPolicy
from page_node.server.guarded import Guarded, read_body, response_from_refusal
from page_node.server.sockets import DriveSockets, ViewSockets

#: The page itself: HTML, style, scripts and words.
STATIC: Final = Path(__file__).resolve().parents[1] / 'static'
#: Most uploads at once: each is held in memory.
_MOST_UPLOADS: Final = 2


def make_app(
    policy: AccessPolicy, endpoints: Iterable[Endpoint], drive: DriveSockets, view: ViewSockets,
    on_start: Callable[[], None] = lambda: None,
) -> Any:
    """
    Return the application for the server.

    Parameters
    ----------
    policy : AccessPolicy
        Who may come in.
    endpoints : iterable of Endpoint
        Of all rooms.
    drive, view
        The two sockets.
    on_start : callable
        Called in the server's event loop before anybody comes in.

    """
    @asynccontextmanager
    async def lifespan(_: Any) -> AsyncIterator[None]:
        on_start()
        watching = asyncio.create_task(drive.watch_driver())
        yield
        watching.cancel()

    uploads = Semaphore(_MOST_UPLOADS)
    routes: list[BaseRoute] = [
        *(Route(each.path, _handler(each, uploads), methods=[each.method]) for each in endpoints),
        WebSocketRoute('/drive', drive.serve), WebSocketRoute('/view', view.serve),
        Route('/', _front_page), Mount('/', StaticFiles(directory=STATIC))]
    return Guarded(Starlette(
        routes=routes, lifespan=lifespan, exception_handlers={
            RefusedError: _on_refusal, HTTPException: _on_http, Exception: _on_mistake}), policy)


async def _front_page(_: Incoming) -> Response:
    return FileResponse(STATIC / 'index.html')


def _handler(endpoint: Endpoint, uploads: Semaphore) -> Any:
    async def handle(incoming: Incoming) -> Response:
        if endpoint.most_bytes > MOST_BYTES:
            if uploads.locked():
                raise RefusedError('busy', 'others upload something just now: try again', 503)
            async with uploads:
                return await answer(incoming)
        return await answer(incoming)

    async def answer(incoming: Incoming) -> Response:
        reply = await endpoint.handler(Request(
            incoming.path_params, incoming.query_params,
            await read_body(incoming, endpoint.most_bytes),
            incoming.headers.get('content-type', '').partition(';')[0].strip().lower()))
        return Response(reply.content, reply.status, dict(reply.headers), reply.media_type)

    return handle


async def _on_refusal(_: Incoming, error: Exception) -> Response:
    assert isinstance(error, RefusedError)
    return response_from_refusal(error)


async def _on_http(_: Incoming, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    code = 'not_found' if error.status_code == 404 else 'malformed'
    return response_from_refusal(RefusedError(code, error.detail, error.status_code))


async def _on_mistake(_: Incoming, __: Exception) -> Response:
    return response_from_refusal(RefusedError(
        'internal', 'page_node has made a mistake, see what it says in its terminal', 500))
