"""A new task whose name is nearly that of an old one: likely a slip of the keys."""

from typing import Final

from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder, tasks
from msgs_bridge.node.close_names import close_name

#: What a person does about the name of a learner's task.
REMEDY: Final = 'set task:={}, or new_task:=true if a new one is meant'


def check_is_meant(task: TaskFolder, remedy: str = REMEDY) -> None:
    """
    Refuse a task without bags whose name is close to that of one with bags.

    Parameters
    ----------
    task : TaskFolder
    remedy : str
        What a person does; ``{}`` stands for the name that may have been meant.

    Raises
    ------
    ValueError
        With the name that may have been meant.

    """
    try:
        if task.episodes() or task.forgotten():
            return
        old = close_name(task.task, tasks(task.root))
    except BagError:
        return  # whoever records into it says so
    if old is not None:
        raise ValueError(f'there is no task {task.task} in {task.root} yet, but {old}: '
                         + remedy.format(old))

