"""
Whose field it is: the name of a task and of what its memory holds.

A revision only counts bags, so that the fields of two tasks have the same ones. The identity goes
with the field to the controller, which says on `trial` by whose field it drives; the learner
learns from trials on its own alone.
"""

from hashlib import blake2b
import re
from typing import Final

import numpy as np

from control_field.records import ControlField, Prototypes
from msgs_bridge.messages.tables import cloud_from_prototypes

#: An identity: the task's name, and 64 bits of what its memory holds.
_IDENTITY: Final = re.compile(r'([A-Za-z0-9_-]{1,64}):[0-9a-f]{16}')
#: What a learner says that has learnt nothing yet: no field has that identity.
NOTHING: Final = 'nothing'


def memory_of(task: str, field: ControlField, prototypes: Prototypes) -> str:
    """
    Return the identity of a task's memory; the same bags of the same task give the same one.

    Parameters
    ----------
    task : str
        Its name.
    field : ControlField
        Learnt from the bags, not one that was changed for a single trial.
    prototypes : Prototypes
        Of that field.

    Returns
    -------
    str
        Such as ``kitchen:3f2a9c0d1e4b5a68``.

    """
    grid = field.grid
    about = (task, grid.frame_id, *grid.shape, grid.resolution, grid.origin_x, grid.origin_y,
             field.revision, *field.goal)
    digest = blake2b('\0'.join(map(str, about)).encode(), digest_size=8)
    for values in (field.vx, field.vy, field.coherence, field.q, field.known, field.flags):
        digest.update(np.ascontiguousarray(values).data)
    digest.update(cloud_from_prototypes(prototypes, field.grid).data)
    return f'{task}:{digest.hexdigest()}'


def task_of(memory: str) -> str:
    """Return the task that an identity names; empty if it is none."""
    match = _IDENTITY.fullmatch(memory)
    return match[1] if match else ''


def is_of_another_task(memory: str, other: str) -> bool:
    """Return whether two identities name different tasks."""
    return len({task_of(memory), task_of(other)} - {''}) == 2


def difference(theirs: str, own: str) -> str:
    """
    Return whose field the controller has, if it is not this learner's; empty if it is.

    Parameters
    ----------
    theirs, own : str
        Identities; ``theirs`` is empty where the controller says none.

    Returns
    -------
    str
        What stands behind "the controller"; it holds the remedy.

    """
    if theirs == own:
        return ''
    if not theirs:
        return ('does not say whose control field it drives by: it has none of this learner yet, '
                'or is of an older version, which is to be updated')
    if not task_of(own):
        return (f'drives by a field of task {task_of(theirs) or theirs}, and this learner has '
                f'none of its own yet')
    if task_of(theirs) == task_of(own):
        return (f'drives by another field of task {task_of(own)}, learnt from other bags '
                f'({theirs}, not {own}): is there a second learner?')
    return (f'drives by the field of task {task_of(theirs) or theirs}, not of {task_of(own)}: a '
            f'second learner publishes control_field here; stop one of them, or give each a '
            f'namespace or a ROS_DOMAIN_ID of its own')
