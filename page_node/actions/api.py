"""The door for the page's buttons."""

from collections.abc import Awaitable, Callable

from msgs_bridge.teaching.answers import Answer
from page_node.actions.wanted import read_wanted, Wanted
from page_node.exchange import Endpoint, json_reply, Reply, Request

#: Carries out what is wanted where ROS is, for who awaits it in the server.
Perform = Callable[[Wanted], Awaitable[Answer]]


def endpoints(perform: Perform) -> list[Endpoint]:
    """Return what the page's buttons ask for."""
    async def act(request: Request) -> Reply:
        answer = await perform(read_wanted(request.path['action'], request.json()))
        return json_reply(
            {'success': answer.success, 'message': answer.message, 'code': answer.code})

    return [Endpoint('POST', '/api/actions/{action}', act)]
