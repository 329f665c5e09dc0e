"""What the memory answers: the list, pictures, drives, fields of a moment, and why."""

from collections.abc import Callable
from concurrent.futures import Future
import math
from typing import Any, Final

from page_node.exchange import Endpoint, FOREVER, Handler, json_reply, Reply, Request
from page_node.memory.field_at import field_at, prototypes_at
from page_node.memory.replay import replay_of
from page_node.memory.rows import list_of
from page_node.memory.thumbnail import thumbnail_of
from page_node.memory.why import get_ready, why
from page_node.memory.worker import PATIENCE, Worker
from page_node.refusal import RefusedError

_BAG: Final = '/api/episodes/{task}/{number}'
_BINARY: Final = 'application/octet-stream'
_PICTURE: Final = 'image/svg+xml'


class MemoryEndpoints:
    """
    Answers for the memory; whatever reads a bag does so in the working process.

    Parameters
    ----------
    worker : Worker
    bags : str
        Folder of the tasks.

    """

    def __init__(self, worker: Worker, bags: str) -> None:
        self._worker, self._bags = worker, bags
        self._getting_ready: Future[None] | None = None

    def all(self) -> list[Endpoint]:
        """Return what is answered, and where."""
        return [
            Endpoint('GET', '/api/episodes', self._list),
            Endpoint('GET', f'{_BAG}/thumbnail', self._thumbnail),
            Endpoint('GET', f'{_BAG}/replay', self._replay),
            Endpoint('GET', f'{_BAG}/field', self._at(field_at)),
            Endpoint('GET', f'{_BAG}/prototypes', self._at(prototypes_at)),
            Endpoint('GET', f'{_BAG}/why', self._why)]

    async def _list(self, request: Request) -> Reply:
        found = await self._worker.ask(list_of, self._bags, request.query.get('task', ''))
        if self._getting_ready is None:
            # Whoever reads the list will soon want to know more.
            self._getting_ready = self._worker.submit(PATIENCE, get_ready)
        return json_reply(found)

    async def _thumbnail(self, request: Request) -> Reply:
        return _kept(request, _PICTURE, await self._worker.ask(
            thumbnail_of, self._bags, *_bag_in(request)))

    async def _replay(self, request: Request) -> Reply:
        return _kept(request, _BINARY, await self._worker.ask(
            replay_of, self._bags, *_bag_in(request)))

    def _at(self, function: Callable[[str, str, str, float], bytes]) -> Handler:
        async def answer(request: Request) -> Reply:
            return _kept(request, _BINARY, await self._worker.ask(
                function, self._bags, *_bag_in(request), _second_in(request)))

        return answer

    async def _why(self, request: Request) -> Reply:
        about: dict[str, Any] = await self._worker.ask(
            why, self._bags, *_bag_in(request), _second_in(request))
        return json_reply(about)


def _kept(request: Request, media_type: str, content: bytes) -> Reply:
    """Return what a browser may keep if the address names the version."""
    return Reply(content, media_type, headers=FOREVER if request.query.get('v') else {})


def _bag_in(request: Request) -> tuple[str, str]:
    return request.path['task'], request.path['number']


def _second_in(request: Request) -> float:
    try:
        at = float(request.query.get('at', ''))
    except ValueError:
        at = math.nan
    if not (math.isfinite(at) and at >= 0.0):
        raise RefusedError('malformed', 'at must be a number of seconds, 0 or more', 400)
    return at
