"""What a bag says of itself before its first message."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
import json
import math
from pathlib import Path
from typing import Any, Final

from control_field.drives.plausibility import SPEED_MAX
from control_field.grid import Grid
from control_field.parameters import Parameters
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeKind

#: Name of the one, at its end, with the messages that the middleware has lost, by topic.
LOST_NAME: Final = 'experience_controller_lost'
#: Version of the bags' own layout.
VERSION: Final = 1


class WorkspaceError(BagError):
    """The bag was recorded in another workspace."""


@dataclass(frozen=True)
class EpisodeHeader:
    """
    What a demonstration or trial started from.

    Parameters
    ----------
    kind : EpisodeKind
        What the bag holds.
    task : str
        Name of the task.
    grid : Grid
        The workspace, with its frame.
    parameters : Parameters
        Of the method.
    topics : mapping of str to str
        Names under which `odom`, `neighbourhood`, `cmd_vel`, `experience` and `trial` were
        recorded; what is not named is found by the last part of its name.
    speed_max : float, [m/s]
        A drive that is faster is not this robot's; old bags do not say.
    memory : str
        Whose field was in force, see `memory_identity`; empty where nobody says, as in old bags.

    """

    kind: EpisodeKind
    task: str
    grid: Grid
    parameters: Parameters = field(default_factory=Parameters)
    topics: Mapping[str, str] = field(default_factory=dict)
    speed_max: float = SPEED_MAX
    memory: str = ''

    def to_mapping(self) -> dict[str, str]:
        """Return the texts that the MCAP metadata record holds."""
        return {
            'version': str(VERSION), 'kind': str(self.kind), 'task': self.task,
            'grid': json.dumps(asdict(self.grid)), 'topics': json.dumps(dict(self.topics)),
            'parameters': json.dumps(asdict(self.parameters)),
            'speed_max': repr(float(self.speed_max)),
            **({'memory': self.memory} if self.memory else {})}

    @classmethod
    def from_mapping(cls, values: Mapping[str, str]) -> 'EpisodeHeader':
        """
        Read the texts of the MCAP metadata record.

        Raises
        ------
        BagError
            If the version is another, or a value is missing or makes no sense.

        """
        version = values.get('version', 'missing')
        if version != str(VERSION):
            raise BagError(f'version of the bag is {version}, must be {VERSION}')
        try:
            return cls(
                kind=EpisodeKind(values['kind']), task=values['task'],
                grid=Grid(**_object(values, 'grid')),
                parameters=Parameters.from_mapping(_object(values, 'parameters')),
                topics=_texts(_object(values, 'topics')), speed_max=_speed(values),
                memory=values.get('memory', ''))
        except KeyError as error:
            raise BagError(f'the header of the bag has no {error.args[0]}') from None
        except (ValueError, TypeError, RecursionError) as error:
            raise BagError(f'the header of the bag makes no sense: {error}') from None

    def check_grid(self, grid: Grid, path: Path) -> None:
        """
        Refuse a bag of another workspace.

        Raises
        ------
        WorkspaceError
            If grid or frame differ; the message names both.

        """
        if self.grid != grid:
            raise WorkspaceError(f'{path} was recorded on {self.grid}, '
                                 f'this workspace is {grid}')


def _object(values: Mapping[str, str], key: str) -> dict[str, Any]:
    found = json.loads(values[key] if key != 'topics' else values.get(key, '{}'))
    if not isinstance(found, dict):
        raise ValueError(f'{key} is no object')
    return found


def _speed(values: Mapping[str, str]) -> float:
    speed = float(values.get('speed_max', SPEED_MAX))
    if not 0.0 < speed < math.inf:
        raise ValueError(f'speed_max is {speed}, must be above 0')
    return speed


def _texts(values: dict[str, Any]) -> dict[str, str]:
    if not all(isinstance(value, str) for value in values.values()):
        raise ValueError('topics must be texts')
    return values
