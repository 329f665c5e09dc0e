"""Which tasks there are to teach: what the working process does for the room."""

from typing import Any

from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import task_folders
from page_node.refusal import RefusedError


def tasks_in(bags: str) -> list[dict[str, Any]]:
    """
    Return the tasks in a bags folder by `name`, each with how many `episodes` it has.

    Raises
    ------
    RefusedError
        If the folder cannot be read.

    """
    try:
        return [{'name': task.task, 'episodes': len(task.episodes())}
                for task in task_folders(bags)]
    except BagError as error:
        raise RefusedError('folder', str(error), 409) from None
