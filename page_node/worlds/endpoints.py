"""What the room answers: which worlds and tasks there are, and how one is saved and used."""

from collections.abc import Awaitable, Callable, Mapping
from functools import partial
from typing import Any, Final

from msgs_bridge.teaching.answers import Answer
from page_node.exchange import Endpoint, json_reply, MOST_UPLOADED, Reply, Request
from page_node.memory.worker import Worker
from page_node.refusal import RefusedError
from page_node.worlds.changer import Changer
from page_node.worlds.folder import WorldsFolder
from page_node.worlds.tasks import tasks_in
from page_node.worlds.uploads import MOST_HEADER, MOST_PIXELS
from page_node.worlds.world_files import frame_of, list_of, path_of, save

#: Runs a coroutine where ROS is, for who awaits it in the server.
Do = Callable[[Callable[[], Awaitable[Any]]], Awaitable[Any]]

_WORLD: Final = '/api/worlds/{name}'


class WorldEndpoints:
    """
    Answers for worlds and tasks; files are read and written in the working process.

    Parameters
    ----------
    worker : Worker
    folder, bags : str
        Of the worlds that were drawn or brought along, and of the tasks.
    changer : Changer
    do : callable

    """

    def __init__(
        self, worker: Worker, folder: str, bags: str, changer: Changer, do: Do,
    ) -> None:
        self._worker, self._folder, self._bags = worker, folder, bags
        self._changer, self._do = changer, do

    def all(self) -> list[Endpoint]:
        """Return what is answered, and where."""
        return [
            Endpoint('GET', '/api/worlds', self._list),
            Endpoint('GET', _WORLD, self._show),
            Endpoint('POST', _WORLD, self._save, MOST_UPLOADED + MOST_HEADER + 4),
            Endpoint('POST', f'{_WORLD}/use', self._use),
            Endpoint('GET', '/api/tasks', self._list_tasks),
            Endpoint('POST', '/api/tasks/{name}/use', self._use_task)]

    async def _list(self, request: Request) -> Reply:
        world = await self._do(self._changer.world)
        return json_reply({
            'worlds': await self._worker.ask(list_of, self._folder),
            'in_use': WorldsFolder(self._folder).name_of(world)})

    async def _show(self, request: Request) -> Reply:
        return Reply(await self._worker.ask(
            frame_of, self._folder, request.path['name'], _most_in(request)),
            'application/octet-stream')

    async def _save(self, request: Request) -> Reply:
        saved = await self._worker.ask(
            save, self._folder, request.path['name'], request.body, request.media_type,
            dict(request.query))
        return json_reply({'success': True, 'message': '', 'code': 'saved', **saved})

    async def _use(self, request: Request) -> Reply:
        task, is_new = _task_in(request.json(), {'task', 'new'})
        world = await self._worker.ask(path_of, self._folder, request.path['name'])
        return await self._changed(world, task, is_new)

    async def _list_tasks(self, request: Request) -> Reply:
        return json_reply({'tasks': await self._worker.ask(tasks_in, self._bags)})

    async def _use_task(self, request: Request) -> Reply:
        _, is_new = _task_in(request.json(), {'new'})
        return await self._changed(None, request.path['name'], is_new)

    async def _changed(self, world: str | None, task: str | None, is_new: bool) -> Reply:
        answer: Answer = await self._do(partial(self._changer.change, world, task, is_new))
        return json_reply(
            {'success': answer.success, 'message': answer.message, 'code': answer.code})


def _most_in(request: Request) -> int:
    """Return how long a side of the picture may be, [pixels]."""
    most = request.query.get('most', str(MOST_PIXELS))
    if not (most.isascii() and most.isdecimal() and 0 < int(most[:9]) <= MOST_PIXELS):
        raise RefusedError('malformed', f'most is 1 to {MOST_PIXELS} pixels', 400)
    return int(most)


def _task_in(body: Mapping[str, Any], allowed: set[str]) -> tuple[str | None, bool]:
    """Return the task that is wanted besides, and whether its name is meant so."""
    task, is_new = body.get('task'), body.get('new', False)
    if set(body) - allowed or not isinstance(is_new, bool) or not (
            task is None or isinstance(task, str)):
        raise RefusedError('malformed', f'this takes {", ".join(sorted(allowed))}', 400)
    return task, is_new
