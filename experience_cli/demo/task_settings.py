"""What a task of the demo may have beside its world: parameters of controller and learner."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from control_field.parameters import Parameters
from experience_cli.errors import UserError
from msgs_bridge.untrusted.files import read_text
from msgs_bridge.untrusted.yaml_texts import yaml_from_text
from world_maps.world import config_file, config_folders

#: Where they stand in the file, which `--params-file` of a node takes, too.
_KEYS: Final = ('/**', 'ros__parameters')


def settings_for(world: str, named: str) -> Mapping[str, Any]:
    """
    Return the learning parameters for a world.

    Parameters
    ----------
    world : str
        As it is given to the simulator.
    named : str
        A file, or the bare name of one in ``config/settings``; empty: that of the name of a world
        of ours, if there is one.

    Raises
    ------
    UserError
        If the file cannot be read, or holds anything else.

    """
    if named:
        try:
            return _read(config_file(named, 'settings', ('.yaml', '.yml')))
        except ValueError as error:
            raise UserError(f'--settings {named}: {error}') from None
    files = [folder / f'{world}.yaml' for folder in config_folders('settings')]
    is_bare = Path(world).name == world and not Path(world).suffix
    ours = next((file for file in files if is_bare and file.is_file()), None)
    return {} if ours is None else _read(ours)


def _read(path: Path) -> Mapping[str, Any]:
    try:
        settings = yaml_from_text(read_text(path))
        for key in _KEYS:
            if not isinstance(settings, dict) or list(settings) != [key]:
                raise ValueError(f'must hold {": ".join(_KEYS)}: and below it learning parameters')
            settings = settings[key]
        if not isinstance(settings, dict):
            raise ValueError(f'no parameters stand below {_KEYS[-1]}:')
        Parameters.from_mapping(settings)
    except OSError as error:
        raise UserError(f'cannot read {path}: {error.strerror or error}') from None
    except (TypeError, ValueError) as error:
        raise UserError(f'{path}: {error}') from None
    return settings
