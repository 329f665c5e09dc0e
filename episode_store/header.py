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
from episode_store.errors import WorkspaceError
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeKind

#: Name of the one, at its end, with the messages that the middleware has lost, by topic.
LOST_NAME: Final = 'experience_controller_lost'
#: Version of the bags' own layout.
VERSION: Final = 1


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
    imported_from : str
        Name of the bag of another recorder that it was taken over from; empty for one of ours.
    imported_notes : tuple of str
        What was made of that bag, and what of it was not read.
    fitted : bool
        Whether the workspace fits itself: ``grid`` is what it was when the bag began, and nothing
        lies outside it.

    """

    kind: EpisodeKind
    task: str
    grid: Grid
    parameters: Parameters = field(default_factory=Parameters)
    topics: Mapping[str, str] = field(default_factory=dict)
    speed_max: float = SPEED_MAX
    memory: str = ''
    imported_from: str = ''
    imported_notes: tuple[str, ...] = ()
    fitted: bool = False

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not 0.0 < self.speed_max < math.inf:
            raise ValueError(f'speed_max is {self.speed_max}, must be above 0')
        if not all(isinstance(topic, str) for topic in self.topics.values()):
            raise ValueError('topics must be texts')

    def to_mapping(self) -> dict[str, str]:
        """Return the texts that the MCAP metadata record holds."""
        return {
            'version': str(VERSION), 'kind': str(self.kind), 'task': self.task,
            'grid': json.dumps(asdict(self.grid)), 'topics': json.dumps(dict(self.topics)),
            'parameters': json.dumps(asdict(self.parameters)),
            'speed_max': repr(float(self.speed_max)),
            **({'fitted': 'true'} if self.fitted else {}),
            **({'memory': self.memory} if self.memory else {}),
            **({'imported_from': self.imported_from,
                'imported_notes': json.dumps(self.imported_notes)} if self.imported_from else {})}

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
                topics=_object(values, 'topics'),
                speed_max=float(values.get('speed_max', SPEED_MAX)),
                memory=values.get('memory', ''), imported_from=values.get('imported_from', ''),
                imported_notes=_notes(values.get('imported_notes', '[]')),
                fitted=_truth(values.get('fitted', 'false'), 'fitted'))
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
            fits = '' if self.grid.offset_to(grid) is None else (
                '; leave rows, cols, origin_x and origin_y out and the workspace fits itself')
            raise WorkspaceError(f'{path} was recorded on {self.grid}, '
                                 f'this workspace is {grid}{fits}')

    def check_lattice(self, grid: Grid, path: Path) -> None:
        """
        Refuse a bag of other cells than those of a workspace that fits itself.

        Parameters
        ----------
        grid : Grid
            Any grid of its lattice.
        path : Path
            Of the bag.

        Raises
        ------
        WorkspaceError
            If frame, size or place of the cells differ; the message names both.

        """
        if self.grid.offset_to(grid) is None:
            raise WorkspaceError(
                f'{path} was recorded on {self.grid}, whose cells are not those of this workspace '
                f'({lattice_text(grid)}): they differ in size, frame or place; learn it as a task '
                f'of its own, or with the resolution and the frame of the others')


def lattice_text(grid: Grid) -> str:
    """Say which cells those of a grid are, whatever its extent."""
    x, y = grid.lattice.world_from_cell(0, 0)
    return f'cells of {grid.resolution:g} m, one at ({x:g}, {y:g}), in {grid.frame_id!r}'


def _object(values: Mapping[str, str], key: str) -> dict[str, Any]:
    found = json.loads(values[key] if key != 'topics' else values.get(key, '{}'))
    if not isinstance(found, dict):
        raise ValueError(f'{key} is no object')
    return found


def _truth(text: str, key: str) -> bool:
    if text not in ('true', 'false'):
        raise ValueError(f'{key} is {text[:40]!r}, must be true or false')
    return text == 'true'


def _notes(text: str) -> tuple[str, ...]:
    """Return the notes that are texts; they are for people, nothing hangs on them."""
    try:
        notes = json.loads(text)
    except (ValueError, RecursionError):
        return ()
    found = notes if isinstance(notes, list) else []
    return tuple(note for note in found if isinstance(note, str))


def find_topic(topics: Mapping[str, str], role: str, names: Mapping[str, str]) -> str:
    """
    Return the topic that plays a role: the one named, else the one whose name ends in it.

    Raises
    ------
    BagError
        If several end in it.

    """
    if role in names:
        return names[role]
    found = sorted(topic for topic in topics if topic.rpartition('/')[2] == role)
    if len(found) > 1:
        raise BagError(f'{role} may be {" or ".join(found)}: name one')
    return found[0] if found else f'/{role}'
