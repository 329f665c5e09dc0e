"""The folder of worlds that were drawn or brought along, and the worlds that come with us."""

from collections.abc import Iterator, Mapping
import os
from pathlib import Path
import re
from typing import Final, NamedTuple

from msgs_bridge.untrusted.files import check_held
from page_node.refusal import RefusedError
from world_maps.map_server import read_header
from world_maps.world import config_folders

#: So many are listed, and so many may be made.
MOST_WORLDS: Final = 200
_NAME: Final = re.compile(r'[A-Za-z0-9][A-Za-z0-9_-]{0,63}')


class WorldFile(NamedTuple):
    """A world: what it is called, where it is, and whether it is one of the folder's."""

    name: str
    path: Path
    is_own: bool


def check_name(name: str) -> str:
    """
    Return a name if it can be a file's.

    Raises
    ------
    RefusedError
        If it holds anything but letters, digits, ``_`` and ``-``.

    """
    if _NAME.fullmatch(name) is None:
        raise RefusedError('bad_name', f'{name[:80]!r} is no name, must be 1 to 64 letters a to '
                           f'z, digits, _ or -, and begin with a letter or digit', 400)
    return name


class WorldsFolder:
    """
    Finds worlds by their names; no file outside of the folder, and of ours, is one.

    Parameters
    ----------
    path : str or Path
        It may be missing until the first world is saved.

    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path).resolve()

    def own(self) -> list[WorldFile]:
        """Return the worlds in the folder, by name; links that lead out are none."""
        try:
            names = sorted(entry.name for entry in os.scandir(self.path)
                           if entry.name.endswith('.yaml'))
        except OSError:
            return []
        return [WorldFile(Path(name).stem, self.path / name, True) for name in names
                if _NAME.fullmatch(Path(name).stem)][:MOST_WORLDS]

    def all(self) -> list[WorldFile]:
        """Return the worlds in the folder, then those that come with us."""
        own = {world.name: world for world in self.own()}
        return [*own.values(), *(world for name, world in shipped().items() if name not in own)]

    def find(self, name: str) -> WorldFile:
        """
        Return the world of a name, of which all files are where they may be.

        Raises
        ------
        RefusedError
            If there is none, or one of its files leads out of the folder.

        """
        check_name(name)
        world = WorldFile(name, self.path / f'{name}.yaml', True)
        if not os.path.lexists(world.path):
            found = shipped().get(name)
            if found is None:
                raise RefusedError('no_world', f'there is no world {name}')
            return found
        try:
            check_held(world.path, self.path)
            check_held(read_header(world.path).image, self.path)
        except (OSError, ValueError) as error:
            raise RefusedError('unreadable', str(error), 409) from None
        return world

    def name_of(self, world: str) -> str:
        """Return what a simulator's parameter `world` is called here; empty if it is unknown."""
        by_path = {str(each.path): each.name for each in self.all()}
        known = {**{name: name for name in shipped()}, **by_path}
        return known.get(world, '')


def shipped() -> Mapping[str, WorldFile]:
    """Return the worlds that come with us, by name."""
    return {world.name: world for world in _shipped()}


def _shipped() -> Iterator[WorldFile]:
    for folder in reversed(config_folders('worlds')):
        for path in sorted(folder.glob('*.yaml')):
            yield WorldFile(path.stem, path, False)
