"""What moves and changes in a world while it is evaluated: read, and held against the world."""

from collections.abc import Callable, Sequence
import sys

from control_field.grid import Grid
from experience_cli.errors import UserError
from experience_evaluation.environment import Environment
from experience_evaluation.experiment import Change, Experiment
from world_maps.changes import in_cells
from world_maps.movers_file import find_movers, load_movers, Script
from world_maps.world import World, WorldError


def read_script(name: str | None, world: World, n_trials: int,
                ) -> tuple[Script, tuple[Change, ...]]:
    """
    Read the file of ``--movers``: what moves or changes within trials, and what between them.

    Raises
    ------
    UserError
        If it is missing or malformed, or does not fit the world.

    """
    if name is None:
        return Script(), ()
    try:
        script = load_movers(find_movers(name), world)
    except WorldError as error:
        raise UserError(f'--movers {error}') from error
    within = Script(script.movers, tuple(
        in_cells(change, world) for change in script.changes if change.at_trial is None))
    changes = dict[int, Change]()
    for change in sorted((change for change in script.changes if change.at_trial is not None),
                         key=lambda change: change.at_trial or 0):
        after = (change.at_trial or 0) - 1
        if after >= n_trials:
            print(f'experience evaluate: --movers {name}: {change.name} at trial {after + 1}, '
                  f'which there is not with --trials {n_trials}', file=sys.stderr)
            continue
        world = world.with_pixels(change.of(world.pixels.occupancy))
        said = f'{changes[after].world}, ' if after in changes else f'{name}: '
        changes[after] = Change(after, world.occupancy, said + change.name)
    return within, tuple(changes.values())


def read_changes(named: Sequence[tuple[int, str]], grid: Grid, n_trials: int,
                 read: Callable[[str], World]) -> tuple[Change, ...]:
    """
    Read the worlds of ``--change``; print what is to be known of their files.

    Parameters
    ----------
    named : sequence of (int, str)
        Numbers of trials, and the world after each.
    grid : Grid
        Of the first world.
    n_trials : int
    read : callable
        Reads a world by its name.

    Raises
    ------
    UserError
        If a world cannot be read or has another size, or if a change comes too early or too late.

    """
    changes: list[Change] = []
    for after, name in named:
        what = f'--change {after}:{name}'
        if after >= n_trials:
            raise UserError(f'{what}: there is no trial {after + 1}, with --trials {n_trials} K '
                            f'must be below {n_trials}')
        if changes and after <= changes[-1].after:
            raise UserError(f'{what}: comes after the change at {changes[-1].after}, name the '
                            f'changes in the order of their trials, one at each')
        changes.append(_read(what, after, name, grid, read))
    return tuple(changes)


def _read(what: str, after: int, name: str, grid: Grid, read: Callable[[str], World]) -> Change:
    try:
        world = read(name)
    except WorldError as error:
        raise UserError(f'--change {after}:{error}') from error
    if _size(world.grid) != _size(grid):
        raise UserError(f'{what}: {_size(world.grid)}, must be like the world of --world: '
                        f'{_size(grid)}')
    for note in world.notes:
        print(f'experience evaluate: --change {after}:{note}', file=sys.stderr)
    return Change(after, world.occupancy, name)


def _size(grid: Grid) -> str:
    return (f'{grid.n_rows} x {grid.n_cols} cells of {grid.resolution:g} m from '
            f'{grid.origin_x:g},{grid.origin_y:g} on')


def check_changes(experiment: Experiment) -> None:
    """
    Say what becomes of goal and starts where the world changes.

    Raises
    ------
    UserError
        If no trial can start any more.

    """
    try:
        _, *environments = experiment.environments()
    except ValueError as error:
        raise UserError(f'--movers: {error} that a change makes') from error
    for change, environment in zip(experiment.changes, environments, strict=True):
        what = f'after trial {change.after}, {change.world}'
        start = experiment.demo_starts[0]
        if not experiment.spread and environment.world.truth[start] != 0:
            raise UserError(f'{what}: blocks the start of all trials, choose --starts spread or '
                            f'another world')
        if not environment.startable.any():
            raise UserError(f'{what}: leaves no free cell that a trial could start from')
        for note in _notes(experiment, environment):
            print(f'experience evaluate: {what}: {note}', file=sys.stderr)


def _notes(experiment: Experiment, environment: Environment) -> list[str]:
    """Return what a person should know of a world that a change has made."""
    truth, reachable = environment.world.truth, environment.reachable
    notes = []
    if truth[experiment.goal] != 0:
        notes.append('the goal is blocked there: nothing is judged until it is free again')
    elif not reachable[experiment.demo_starts[0]]:
        notes.append('no way leads there from the (first) start to the goal')
    n_lost = int((experiment.reachable() & (truth == 0) & ~reachable).sum())
    if n_lost and truth[experiment.goal] == 0:
        notes.append(f'{n_lost} free cells have no way to the goal any more: they are not judged, '
                     f'trials may start there')
    return notes
