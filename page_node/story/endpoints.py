"""What the story answers: what each episode came to, and the field after it."""

from page_node.exchange import Endpoint, FOREVER, json_reply, Reply, Request
from page_node.memory.worker import Worker
from page_node.story.frame import frame_after
from page_node.story.story import story_of


class StoryEndpoints:
    """
    Answers for the story; whatever reads a bag does so in the working process.

    Parameters
    ----------
    worker : Worker
    bags : str
        Folder of the tasks.

    """

    def __init__(self, worker: Worker, bags: str) -> None:
        self._worker, self._bags = worker, bags

    def all(self) -> list[Endpoint]:
        """Return what is answered, and where."""
        return [Endpoint('GET', '/api/story', self._story),
                Endpoint('GET', '/api/story/{task}/{number}', self._frame)]

    async def _story(self, request: Request) -> Reply:
        return json_reply(await self._worker.ask(
            story_of, self._bags, request.query.get('task', '')))

    async def _frame(self, request: Request) -> Reply:
        content = await self._worker.ask(
            frame_after, self._bags, request.path['task'], request.path['number'])
        return Reply(content, 'application/octet-stream',
                     headers=FOREVER if request.query.get('v') else {})
