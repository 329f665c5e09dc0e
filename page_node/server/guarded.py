"""The guard as a layer of the server: nothing behind it sees what it refuses."""

import asyncio
import logging
from typing import Any, Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request as Incoming
from starlette.responses import RedirectResponse, Response

from page_node.exchange import json_bytes
from page_node.refusal import RefusedError
from page_node.server.guard import AccessPolicy, HEADERS

#: How long a body may take to come, [s].
_BODY_TIME: Final = 30.0
#: What is too long for any address of ours, [bytes].
_MOST_ADDRESS: Final = 2048
_LOG: Final = logging.getLogger('page_node')

#: Shown instead of the page to who has no token.
_NO_ENTRY: Final = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><title>page_node</title>'
    '<p>This page needs the address with its token, as page_node printed it when it started: '
    'http://.../?token=...</p></html>')
#: Sends a browser that followed a link from elsewhere here once more: it keeps the cookie back
#: from what another page has begun.
_AGAIN: Final = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><title>page_node</title>'
    '<meta http-equiv="refresh" content="0;url=/"></html>')


class Guarded:
    """
    Checks each request and each socket, and adds the headers of `HEADERS` to every answer.

    Parameters
    ----------
    app : callable
        What is guarded.
    policy : AccessPolicy

    """

    def __init__(self, app: Any, policy: AccessPolicy) -> None:
        """Keep both."""
        self._app, self._policy = app, policy

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass on what may come in."""
        if scope['type'] == 'http':
            await self._serve(scope, receive, _with_headers(send))
        elif scope['type'] == 'websocket':
            await self._connect(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _connect(self, scope: Any, receive: Any, send: Any) -> None:
        try:
            self._check(scope, Headers(scope=scope), is_reading=False)
        except RefusedError:
            await send({'type': 'websocket.close', 'code': 1008})
            return
        try:
            await self._app(scope, receive, send)
        except Exception:
            _LOG.exception('%s', scope['path'])

    async def _serve(self, scope: Any, receive: Any, send: Any) -> None:
        headers = Headers(scope=scope)
        try:
            response = self._answer(scope, headers)
        except RefusedError as refusal:
            response = _refused(scope, headers, refusal)
        try:
            await (response or self._app)(scope, receive, send)
        except Exception:  # it was answered as such
            _LOG.exception('%s', scope['path'])

    def _answer(self, scope: Any, headers: Headers) -> Response | None:
        """Return what the guard answers itself; None for what goes on."""
        is_reading = scope['method'] in ('GET', 'HEAD')
        self._check(scope, headers, is_reading)
        if scope['path'] == '/' and is_reading and self._policy.is_shown_in(_query(scope)):
            return self._let_in(headers)
        return None

    def _check(self, scope: Any, headers: Headers, is_reading: bool) -> None:
        host = headers.get('host', '')
        if len(scope['raw_path'] or b'') + len(scope['query_string']) > _MOST_ADDRESS:
            raise RefusedError('too_long', 'there is no such address', 414)
        self._policy.check_host(host)
        self._policy.check_origin(host, headers, is_reading)
        if not self._policy.knows(headers, _query(scope)):
            raise RefusedError('no_token', 'the address lacks its token, ?token=...', 403)

    def _let_in(self, headers: Headers) -> Response:
        """Keep the token in a cookie, and take it out of the address."""
        response = RedirectResponse('/', 303)
        response.set_cookie(
            self._policy.cookie, self._policy.token, httponly=True, samesite='strict', path='/',
            secure=headers.get('x-forwarded-proto') == 'https')
        return response


def _query(scope: Any) -> str:
    return str(scope['query_string'].decode('latin-1'))


def _refused(scope: Any, headers: Headers, refusal: RefusedError) -> Response:
    if refusal.code != 'no_token' or scope['path'] != '/':
        return response_from_refusal(refusal)
    if headers.get('sec-fetch-site') in ('cross-site', 'same-site') and 'cookie' not in headers:
        return Response(_AGAIN, media_type='text/html')
    return Response(_NO_ENTRY, refusal.status, media_type='text/html')


def response_from_refusal(refusal: RefusedError) -> Response:
    """Return what a browser gets instead of what it asked for."""
    return Response(json_bytes({'code': refusal.code, 'message': refusal.message}),
                    refusal.status, media_type='application/json')


def _with_headers(send: Any) -> Any:
    async def sending(message: Any) -> None:
        if message['type'] == 'http.response.start':
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers[name] = value
            headers.setdefault('Cache-Control', 'no-cache')
        await send(message)

    return sending


async def read_body(incoming: Incoming, most: int) -> bytes:
    """
    Return the body of a request.

    Raises
    ------
    RefusedError
        If it is longer than ``most``, or takes too long to come.

    """
    told = incoming.headers.get('content-length', '0')
    if not told.isdecimal() or int(told) > most:
        raise _too_big(most)
    body = bytearray()
    try:
        async with asyncio.timeout(_BODY_TIME):
            async for part in incoming.stream():
                body += part
                if len(body) > most:
                    raise _too_big(most)
    except TimeoutError:
        raise RefusedError('too_slow', 'this did not arrive in time', 408) from None
    return bytes(body)


def _too_big(most: int) -> RefusedError:
    return RefusedError('too_big', f'this has more than {most} bytes', 413)
