"""`experience learn`: the field from nothing but the bags."""

import argparse
from collections.abc import Iterator
import hashlib
from pathlib import Path
import sys
from typing import Any

from episode_store.rosbag2.errors import BagError
from experience_cli.commands import learn_import as external
from experience_cli.errors import UserError
from msgs_bridge.untrusted.text import own_stream


def add_parser(subparsers: Any) -> argparse.ArgumentParser:
    """Add the command."""
    parser: argparse.ArgumentParser = subparsers.add_parser(
        'learn', help='learn anew from bags, and say what each has taught',
        description='Learn anew from bags, in the order of their numbers, and say what each of '
        'them has taught. The same bags always give the same field, byte for byte the one that '
        'learner_node published.')
    parser.add_argument('bags', nargs='+', type=Path, metavar='BAG_OR_TASK',
                        help='task1/0003, task1, or the folder of a bag or a task; bags of other '
                        'recorders')
    parser.add_argument('--save', type=Path, metavar='FIELD.npz', help='write the field here')
    parser.add_argument('--check', action='store_true',
                        help='compare with the fields that the live learner published, and '
                        'fail where a bag is incomplete')
    parser.add_argument('-v', '--verbose', action='store_true',
                        help='say of each bag in numbers, too, what it taught')
    parser.add_argument('--quiet', action='store_true', help='print the last line only')
    external.add_options(parser, keeping=True)
    return parser


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return 1 if a check finds another field, or an incomplete bag."""
    from experience_cli.bag_argument import named_path

    if arguments.save is not None and arguments.save.suffix != '.npz':
        raise UserError(f'--save {arguments.save}: must end in .npz')
    arguments.bags = [named_path(path) for path in arguments.bags]
    if arguments.like is not None:
        arguments.like = named_path(arguments.like)
    if not external.is_wanted(arguments) and not _are_external(arguments.bags):
        return _learn(arguments, arguments.bags)
    if arguments.into is not None:
        return _learn(arguments, [external.import_all(arguments)])
    if arguments.check:
        raise UserError('--check: bags of other recorders hold no field to compare with')
    learner = external.learn_external(arguments)
    _finish(arguments, learner.refresh, learner.trial_field(curious=False))
    return 0


def _are_external(paths: list[Path]) -> bool:
    """Tell whether bags are those of other recorders: all of them, or none."""
    from experience_cli.bag_selection import is_external

    theirs = [path for path in paths if is_external(path)]
    ours = [path for path in paths if path not in theirs]
    if theirs and ours:
        raise UserError(
            f'{theirs[0]} is a bag of another recorder, {ours[0]} is not: keep it as a '
            f'demonstration of a task with --into first, and learn that task')
    return bool(theirs)


def _learn(arguments: argparse.Namespace, paths: list[Path]) -> int:
    """Learn from bags of ours."""
    from episode_store.relearn import Relearner
    from episode_store.relearning import last_header
    from episode_store.workspace import odd_one_named
    from experience_cli.bag_selection import episodes_from_paths
    from experience_cli.damage_notes import say_cuts, say_gaps

    try:
        episodes = episodes_from_paths(paths)
    except BagError as error:
        raise UserError(f'{error}; bags of other recorders are learnt with --odom-topic') from None
    header = last_header(episodes)
    if header is None:
        raise UserError(f'nothing was learnt: {episodes[-1].path} holds nothing to learn from')
    relearner = Relearner(header.grid, header.parameters)
    differing, n_compared, n_gaps = [], 0, 0
    with odd_one_named(episodes):
        for episode in _with_progress(episodes):
            if arguments.check and episode.bag.exists():
                differs = recorded_differs(episode, relearner)
                n_compared += differs is not None
                if differs:
                    differing.append(episode)
            learnt_bag = relearner.learn(episode)
            say_cuts('learn', [episode])
            n_gaps += say_gaps('learn', episode)
            if not arguments.quiet:
                _print(text_from_learnt_bag(learnt_bag, arguments.verbose))
    if relearner.refresh is None:
        raise UserError('nothing was learnt: there is no demonstration in these bags')
    _finish(arguments, relearner.refresh, relearner.field())
    return _checked(arguments, episodes, differing, n_compared, n_gaps) if arguments.check else 0


def _checked(
    arguments: argparse.Namespace, episodes: list[Any], differing: list[Any], n_compared: int,
    n_gaps: int,
) -> int:
    """Say what a check has found; return 1 if a field differs or a bag is incomplete."""
    from control_field.words import counted

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
    from control_field.words import counted

    if not n_compared:
        return '--check: none of these bags holds a field to compare with'
    return (f'--check: {counted(n_compared, "bag")} with a recorded field, each is the relearnt '
            f'one byte for byte')


def _difference(episodes: list[Any], differing: list[Any]) -> str:
    """Say which recorded fields differ, and what people have changed before those bags since."""
    from episode_store.changes import changes_before

    names = ', '.join(episode.name for episode in differing)
    said = (f'the field{"s" if len(differing) > 1 else ""} recorded in {names} '
            f'differ{"s" if len(differing) == 1 else ""} from the relearnt one')
    changes = changes_before(episodes, differing[0].number)
    return f'{said}; since then {", ".join(changes)}' if changes else said


def _finish(arguments: argparse.Namespace, refresh: Any, field: Any) -> None:
    """Write the field, and say which one it is."""
    from experience_cli.field_file import save_field

    if arguments.save is not None:
        save_field(arguments.save, refresh, field.grid)
    print(f'control_field revision {field.revision} sha256 {digest(field)}')


def _with_progress(episodes: list[Any]) -> Iterator[Any]:
    from tqdm import tqdm

    yield from tqdm(episodes, unit='bag', leave=False, file=own_stream(sys.stderr),
                    disable=not sys.stderr.isatty())


def _print(line: str) -> None:
    from tqdm import tqdm

    tqdm.write(line)


def text_from_learnt_bag(learnt_bag: Any, verbose: bool = False) -> str:
    """Say what a bag taught, in numbers, too, where that is asked for."""
    from learner_node.reports import (
        numbers_from_learnt_bag, sentence_from_learnt_bag, trial_number)

    episode, number = learnt_bag.episode, trial_number(learnt_bag)
    name = f'{episode.name} {episode.kind}' + (f' {number}' if number else '')
    said = sentence_from_learnt_bag(learnt_bag, name)
    numbers = numbers_from_learnt_bag(learnt_bag) if verbose else ''
    return f'{said}\n    in numbers: {numbers}' if numbers else said


def field_bytes(field: Any) -> bytes:
    """Return the bytes of a field's table, as in ``data`` of its message on `control_field`."""
    from msgs_bridge.messages.tables import cloud_from_field

    return bytes(cloud_from_field(field).data)


def digest(field: Any) -> str:
    """Return the SHA-256 of a field's bytes."""
    return hashlib.sha256(field_bytes(field)).hexdigest()


def recorded_differs(episode: Any, relearner: Any) -> bool | None:
    """
    Tell whether a bag begins with another field than the one its predecessors have taught.

    None for one that holds no field, such as a drive that others recorded.
    """
    from episode_store.episode import find_topic
    from episode_store.rosbag2.reader import BagReader
    from msgs_bridge.messages.cdr import POINT_CLOUD, struct_from_cdr

    bag = BagReader(episode.bag)
    recorded = bag.messages(find_topic(bag.topics, 'control_field', {}))
    if not len(recorded):
        return None
    if relearner.refresh is None:
        return True
    data = struct_from_cdr(POINT_CLOUD, recorded[0])['data'].tobytes()
    return data not in (field_bytes(relearner.field()), field_bytes(relearner.field(curious=True)))
