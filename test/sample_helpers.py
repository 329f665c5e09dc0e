"""The sample bags as a task that tests may change."""

from collections.abc import Callable
from pathlib import Path
import shutil
from typing import Any

from control_field.learning.learner import Refresh
from episode_store.making import start_bag
from episode_store.relearn import relearnt
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import episode_from_path, EpisodeFolder, TaskFolder
from msgs_bridge.messages.tables import cloud_from_field, cloud_from_prototypes

BAGS = Path(__file__).resolve().parent.parent / 'bags'
#: A demonstration and two trials that it led to.
DEMO, FIRST, SECOND = 'sample/0001', 'sample/0002', 'sample/0003'


def sample_copy(folder: Path, name: str = 'bags') -> TaskFolder:
    """Copy the sample task into a bags folder; return it."""
    shutil.copytree(BAGS / 'sample', folder / name / 'sample',
                    ignore=shutil.ignore_patterns('.*'))
    return TaskFolder(folder / name, 'sample')


def rewritten(task: TaskFolder, number: int, change: Callable[..., Any]) -> EpisodeFolder:
    """Record a bag anew, message by message: ``change(topic, message)`` returns what goes in."""
    old = task.find(number)
    reader = BagReader(old.bag)
    [header] = [values for name, values in reader.metadata if name == 'experience_controller']
    with start_bag(task, old.kind, header) as bag:
        for channel, log_time, publish_time, message in reader.records():
            for topic, type_name, cdr in change(channel.topic, channel.schema.name, message):
                bag.write(topic, type_name, cdr, log_time, publish_time)
    return episode_from_path(bag.folder)


def bytes_of(refresh: Refresh | None) -> tuple[bytes, bytes]:
    """Return the bytes of a field and of its prototypes."""
    assert refresh is not None
    return (bytes(cloud_from_field(refresh.field).data),
            bytes(cloud_from_prototypes(refresh.prototypes, refresh.field.grid).data))


def field_of(task: TaskFolder) -> tuple[bytes, bytes]:
    """Return the bytes of what a task's bags teach."""
    return bytes_of(relearnt(task))


def files_of(folder: Path) -> dict[str, bytes]:
    """Return every file under a folder, by its name there."""
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob('*'))
            if path.is_file() and path.name not in ('.lock', '.in_use')}
