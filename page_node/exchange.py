"""What a room of the page answers requests with, whatever server carries them."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
import json
from typing import Any, Final

from page_node.refusal import RefusedError

#: Greatest body of a request, [bytes], where an endpoint sets no other limit.
MOST_BYTES: Final = 65_536
#: Greatest body of an upload, [bytes].
MOST_UPLOADED: Final = 16 * 1024 * 1024
#: Headers of what is asked for with its version: it never changes.
FOREVER: Final = {'Cache-Control': 'private, max-age=604800, immutable'}


@dataclass(frozen=True)
class Request:
    """
    What came from a browser, past the guard.

    Parameters
    ----------
    path : mapping
        What stands for the names in braces of the endpoint's path.
    query : mapping
        Behind the question mark; the last of each name.
    body : bytes
    media_type : str
        What the browser says that the body is.

    """

    path: Mapping[str, str] = field(default_factory=dict)
    query: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b''
    media_type: str = ''

    def json(self) -> dict[str, Any]:
        """
        Return the body, a JSON object; an empty body is an empty one.

        Raises
        ------
        RefusedError
            If it is anything else.

        """
        return json_object(self.body) if self.body else {}


@dataclass(frozen=True)
class Reply:
    """What goes back to the browser."""

    content: bytes
    media_type: str = 'application/json'
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)


Handler = Callable[[Request], Awaitable[Reply]]


@dataclass(frozen=True)
class Endpoint:
    """
    A path and what answers there, in the server's event loop: whatever takes long is awaited.

    Parameters
    ----------
    method : str
        ``GET`` or ``POST``.
    path : str
        Such as ``/api/episodes/{name}/why``; a name in braces stands for anything but a slash.
    handler : callable
    most_bytes : int
        Greatest body.

    """

    method: str
    path: str
    handler: Handler
    most_bytes: int = MOST_BYTES


def json_reply(value: Any, status: int = 200) -> Reply:
    """Return a value as JSON; what is not finite is no JSON, and an error of ours."""
    return Reply(json_bytes(value), status=status)


def json_bytes(value: Any) -> bytes:
    """Return the shortest JSON of a value."""
    return json.dumps(value, separators=(',', ':'), ensure_ascii=False, allow_nan=False).encode()


def json_object(text: str | bytes) -> dict[str, Any]:
    """
    Read a JSON object from somebody who may send anything.

    Raises
    ------
    RefusedError
        If it is none, or holds numbers that are none.

    """
    try:
        value = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError):
        raise RefusedError('malformed', 'this is no JSON', 400) from None
    if not isinstance(value, dict):
        raise RefusedError('malformed', 'this is no JSON object', 400)
    return value


def _refuse_constant(name: str) -> Any:
    raise ValueError(f'{name} is no number')
