"""`experience learn`: the field from nothing but the bags."""

import argparse
from collections.abc import Iterator
import hashlib
from pathlib import Path
import sys

import numpy as np
from tqdm import tqdm

from control_field.grid import Grid
from control_field.headings import UNIT
from control_field.learning.learner import Refresh
from control_field.records import ControlField
from control_field.words import counted, sentences
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.external.drive import ExternalDrive
from episode_store.relearn import changes_before, LearntBag, Relearner
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder
from episode_store.workspaces import odd_one_named
from experience_cli.bag_argument import episodes_from_paths, is_external, named_path
from experience_cli.bag_summary import grid_text, say_cut, say_gaps
from experience_cli.errors import UserError
from experience_cli.external_bags import guessed, import_all, taken_over, wanted_option
from experience_cli.output import write_output
from learner_node.reports import numbers_from_learnt_bag, sentence_from_learnt_bag, trial_number
from msgs_bridge.messages.cdr import POINT_CLOUD, struct_from_cdr
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.untrusted.text import own_stream


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return 1 if a check finds another field, or an incomplete bag."""
    if arguments.save is not None and arguments.save.suffix != '.npz':
        raise UserError(f'--save {arguments.save}: must end in .npz')
    if arguments.new_task and arguments.into is None:
        raise UserError('--new-task: says that the task of --into is meant to be new, name it')
    arguments.bags = [named_path(path) for path in arguments.bags]
    if arguments.like is not None:
        arguments.like = named_path(arguments.like)
    if not wanted_option(arguments) and not _are_external(arguments.bags):
        return _learn(arguments, arguments.bags)
    if arguments.into is not None:
        return _learn(arguments, [_import(arguments)])
    if arguments.check:
        raise UserError('--check: bags of other recorders hold no field to compare with')
    return _learn_external(arguments)


def _are_external(paths: list[Path]) -> bool:
    """Return whether bags are those of other recorders: all of them, or none."""
    external = [path for path in paths if is_external(path)]
    own = [path for path in paths if path not in external]
    if external and own:
        raise UserError(
            f'{external[0]} is a bag of another recorder, {own[0]} is not: keep it as a '
            f'demonstration of a task with --into first, and learn that task')
    return bool(external)


def _import(arguments: argparse.Namespace) -> Path:
    """Keep bags of other recorders as demonstrations of a task; return the task's folder."""
    for drive, episode in import_all(arguments):
        if not arguments.quiet:
            print('; '.join([f'{drive.path} is kept as {episode.path}',
                             *guessed(drive, arguments), *drive.notes]))
    return Path(arguments.into.absolute())


def _learn_external(arguments: argparse.Namespace) -> int:
    """Learn bags of other recorders one after the other, without keeping them."""
    with taken_over(arguments, arguments.bags) as taken:
        relearner = Relearner.for_bags([episode for _, episode in taken])
        assert relearner is not None  # all of them were checked
        for drive, episode in taken:
            learnt_bag = relearner.learn(Episode(episode))
            if not arguments.quiet:
                print(_text_from_external(arguments, drive, learnt_bag))
    assert relearner.refresh is not None
    _finish(arguments, relearner.refresh, relearner.field())
    return 0


def _text_from_external(
    arguments: argparse.Namespace, drive: ExternalDrive, learnt_bag: LearntBag,
) -> str:
    """Say what a bag of another recorder taught, in numbers, too, where that is asked for."""
    content, refresh = learnt_bag.content, learnt_bag.refresh
    assert content is not None
    assert content.report is not None
    assert refresh is not None
    report, certificate = content.report, refresh.certificate
    where = [f'The workspace fits the drive: {grid_text(drive.grid)}'] if drive.is_fitted else []
    said = sentences([
        f'{drive.path} is learnt: {counted(report.n_steps, "step")}', learnt_bag.moved,
        *report.sentences(), *guessed(drive, arguments), *content.notes, *drive.notes, *where,
        certificate.sentence()])
    numbers = f'\n    in numbers: {report.numbers()}; {certificate.numbers()}'
    return f'{said}{numbers if arguments.verbose else ""}'


def _learn(arguments: argparse.Namespace, paths: list[Path]) -> int:
    """Learn from bags of own."""
    try:
        episodes = episodes_from_paths(paths)
    except BagError as error:
        raise UserError(f'{error}; bags of other recorders are learnt with --odom-topic') from None
    relearner = Relearner.for_bags(episodes)
    if relearner is None:
        raise UserError(f'nothing was learnt: {episodes[-1].path} holds nothing to learn from')
    differing, n_compared, n_gaps = [], 0, 0
    with odd_one_named(episodes):
        for episode in map(Episode, _with_progress(episodes)):
            if arguments.check:
                differs = recorded_differs(episode, relearner)
                n_compared += differs is not None
                if differs:
                    differing.append(episode.folder)
            learnt_bag = relearner.learn(episode)
            say_cut('learn', episode)
            n_gaps += say_gaps('learn', episode)
            if not arguments.quiet:
                tqdm.write(text_from_learnt_bag(learnt_bag, arguments.verbose))
    if relearner.refresh is None:
        raise UserError('nothing was learnt: there is no demonstration in these bags')
    _finish(arguments, relearner.refresh, relearner.field())
    return _checked(arguments, episodes, differing, n_compared, n_gaps) if arguments.check else 0


def _checked(
    arguments: argparse.Namespace, episodes: list[EpisodeFolder],
    differing: list[EpisodeFolder], n_compared: int, n_gaps: int,
) -> int:
    """Say what a check has found; return 1 if a field differs or a bag is incomplete."""
    if not differing and not arguments.quiet:
        print(f'experience learn: {_agreement(n_compared)}', file=sys.stderr)
    if differing:
        print(f'experience learn: {_difference(episodes, differing)}', file=sys.stderr)
    if n_gaps:
        print(f'experience learn: --check: {counted(n_gaps, "bag")} of these '
              f'{"is" if n_gaps == 1 else "are"} incomplete, see above', file=sys.stderr)
    return 1 if differing or n_gaps else 0


def _agreement(n_compared: int) -> str:
    """Say that no recorded field differs."""
    if not n_compared:
        return '--check: none of these bags holds a field to compare with'
    return (f'--check: {counted(n_compared, "bag")} with a recorded field, each is the relearnt '
            f'one byte for byte')


def _difference(episodes: list[EpisodeFolder], differing: list[EpisodeFolder]) -> str:
    """Say which recorded fields differ, and what people have changed before those bags since."""
    names = ', '.join(episode.name for episode in differing)
    said = (f'the field{"s" if len(differing) > 1 else ""} recorded in {names} '
            f'differ{"s" if len(differing) == 1 else ""} from the relearnt one')
    changes = changes_before(episodes, differing[0].number)
    return f'{said}; since then {", ".join(changes)}' if changes else said


def _finish(arguments: argparse.Namespace, refresh: Refresh, field: ControlField) -> None:
    """Write the field, and say which one it is."""
    if arguments.save is not None:
        save_field(arguments.save, refresh, field.grid)
    print(f'control_field revision {field.revision} sha256 {digest(field)}')


def _with_progress(episodes: list[EpisodeFolder]) -> Iterator[EpisodeFolder]:
    yield from tqdm(episodes, unit='bag', leave=False, file=own_stream(sys.stderr),
                    disable=not sys.stderr.isatty())


def text_from_learnt_bag(learnt_bag: LearntBag, verbose: bool = False) -> str:
    """Say what a bag taught, in numbers, too, where that is asked for."""
    episode, number = learnt_bag.folder, trial_number(learnt_bag)
    name = f'{episode.name} {episode.kind}' + (f' {number}' if number else '')
    said = sentence_from_learnt_bag(learnt_bag, name)
    numbers = numbers_from_learnt_bag(learnt_bag) if verbose else ''
    return f'{said}\n    in numbers: {numbers}' if numbers else said


def field_bytes(field: ControlField) -> bytes:
    """Return the bytes of a field's table, as in ``data`` of its message on `control_field`."""
    return bytes(cloud_from_field(field).data)


def digest(field: ControlField) -> str:
    """Return the SHA-256 of a field's bytes."""
    return hashlib.sha256(field_bytes(field)).hexdigest()


def recorded_differs(episode: Episode, relearner: Relearner) -> bool | None:
    """
    Return whether a bag begins with another field than the one its predecessors have taught.

    None for one that holds no field, such as a drive that others recorded.
    """
    try:
        recorded = episode.messages('control_field')
    except NothingToLearnError:
        return None
    if not len(recorded):
        return None
    if relearner.refresh is None:
        return True
    data = struct_from_cdr(POINT_CLOUD, recorded[0])['data'].tobytes()
    if relearner.fitted:  # it may have been published in a larger workspace, to hold the robot
        relearner = relearner.in_workspace(episode.header.grid)
    fields = relearner.field(), relearner.field(exploring=True)
    return data not in map(field_bytes, fields)


def save_field(path: Path, refresh: Refresh, grid: Grid) -> None:
    """
    Write field and prototypes.

    Arrays: ``vx``, ``vy`` (rows x cols, row 0 at the lowest y), ``centres`` (n, 2) [m],
    ``actions`` (n, 2) unit vectors, ``q`` (n,), ``origin`` (2,) [m], ``resolution`` [m],
    ``q_matrix`` (rows, cols, 8), ``known`` (rows, cols), ``goal`` (2,) row and column,
    ``revision`` (from how many bags it was learnt), ``demonstrated`` (n,).

    Raises
    ------
    UserError
        If the file cannot be written.

    """
    field, prototypes = refresh.field, refresh.prototypes
    write_output(path, lambda file: np.savez_compressed(
        file, vx=field.vx, vy=field.vy, centres=grid.world_from_cells(prototypes.cells),
        actions=UNIT[prototypes.headings], q=prototypes.q,
        origin=np.array([grid.origin_x, grid.origin_y]), resolution=np.array(grid.resolution),
        q_matrix=field.q, known=field.known, goal=np.array(field.goal),
        revision=np.array(field.revision), demonstrated=prototypes.demonstrated))
