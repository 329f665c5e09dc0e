"""`experience show`: what a bag holds."""

import argparse
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from functools import partial
import importlib
import json
from pathlib import Path
import sys
from typing import Any, Final

import numpy as np

from control_field.compass import compass, DIRECTIONS
from control_field.drives.demonstration import DemonstrationReport
from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import Demonstration, Kind, Trial
from control_field.words import counted, how_it_ended
from episode_store.episode import Episode
from episode_store.errors import NothingToLearnError
from episode_store.header import EpisodeHeader
from episode_store.rosbag2.errors import BagError
from episode_store.summary import summary_of
from experience_cli.bag_argument import find_readable_bag
from experience_cli.bag_overview import about_external, lines_from_external, overview, Way, way_of
from experience_cli.bag_summary import (
    demonstration_about, grid_text, say_cut, size_text, time_text)
from experience_cli.drive_drawing import drawing_lines
from experience_cli.external_bags import is_borrowed, there
from experience_cli.output import write_output
from experience_cli.terminal import table_lines

#: What was done in a step that did not just follow the field.
_DONE: Final[Mapping[str, str]] = {
    'blocked': 'the way {} is blocked', 'avoid': 'goes {} around it',
    'explore': 'tries {} to get out of a circle', 'taught': 'a person drives {}',
    'detour': 'goes {}: the way ahead is known to be blocked farther on'}


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    path = Path(arguments.bag)
    if is_borrowed(arguments, path):
        found = overview(arguments, there(path))
        about = about_external(found, path, arguments.odom_topic is not None)
        way = way_of(found)
        lines = lines_from_external(about, way)
        grid = found.drive.grid if found.drive is not None and found.content else None
    else:
        episode = Episode(find_readable_bag(arguments.bag, arguments.bags))
        about, way, grid = about_bag(episode), driven(episode), episode.header.grid
        say_cut('show', episode)
        lines = lines_from(about, way)
    print(json.dumps(about, indent=2) if arguments.json else '\n'.join(lines))
    if arguments.out is not None:
        figures = importlib.import_module('experience_cli.figures.drive_figure')  # slow
        figure = figures.drive_figure(str(arguments.bag), *way, grid)
        write_output(arguments.out, partial(figure.savefig, format='png'))
        print(arguments.out, file=sys.stderr if arguments.json else sys.stdout)
    return 0


def driven(episode: Episode) -> Way:
    """Return where the robot was in a bag, and which of that is cut out."""
    poses = episode.poses
    sound = np.isfinite(poses.xyyaw).all(axis=1)
    stamps, path = poses.stamps[sound], poses.xyyaw[sound, :2]
    cut = np.zeros(len(path), dtype=np.bool_)
    with suppress(BagError):
        report = episode.content.report
        for loop in report.loops if report else ():
            cut |= (stamps >= loop.first) & (stamps <= loop.last)
    return path, cut


def about_bag(episode: Episode) -> dict[str, Any]:
    """
    Return all there is to say of a bag, ready for JSON.

    Raises
    ------
    BagError
        If it cannot be read.

    """
    header, gaps = episode.header, episode.gaps
    return {
        **summary_of(episode).to_json(), 'start': episode.start,
        'holes': gaps.to_json(), 'before_the_drive': gaps.before_the_drive(),
        'grid': asdict(header.grid), 'fitted': header.fitted,
        'parameters': asdict(header.parameters),
        'imported': _imported(header),
        'topics': [{'topic': topic, 'type': episode.bag.topics[topic], 'messages': n}
                   for topic, n in episode.bag.counts.items()],
        **_content(episode)}


def _imported(header: EpisodeHeader) -> str:
    """Say from which bag of another recorder a bag was taken over, and what was made of it."""
    if not header.imported_from:
        return ''
    return '; '.join([f'from {header.imported_from}', *header.imported_notes])


def _content(episode: Episode) -> dict[str, Any]:
    try:
        content = episode.content
    except NothingToLearnError:
        return {}
    grid = episode.header.grid
    if isinstance(content.record, Demonstration):
        assert content.report is not None  # every demonstration has one
        return {'demonstration': demonstration_about(content.record, content.report, grid)}
    return {'decisions': _decisions(content.record, episode.start, grid)}


def _decisions(trial: Trial, start: float, grid: Grid) -> dict[str, Any]:
    rows = trial.decisions
    kinds = Counter(Kind(int(kind)).name.lower() for kind in rows['kind'])
    return {
        'count': len(rows), 'kinds': dict(sorted(kinds.items())),
        'reinforcements': trial.n_reinforcements,
        'online_reinforcements': trial.n_online_reinforcements,
        'reward': int(rows['reward'].sum(dtype=int)),
        'start_cell': [int(rows[name][0]) for name in ('row', 'col')] if len(rows) else None,
        'last_cell': [int(rows[name][-1]) for name in ('next_row', 'next_col')] if (
            len(rows)) else None,
        'notable': [_event(row, start, grid) for row in rows if row['kind'] != Kind.FIELD]}


def _event(row: Any, start: float, grid: Grid) -> dict[str, Any]:
    """Say what a decision was that did not just follow the field."""
    return {
        'at': round(float(row['stamp']) - start, 3), 'cell': [int(row['row']), int(row['col'])],
        'place': list(grid.world_from_cell(int(row['row']), int(row['col']))),
        'kind': Kind(int(row['kind'])).name.lower(), 'heading': compass(int(row['action'])),
        'reward': int(row['reward'])}


def lines_from(about: dict[str, Any], way: Way) -> list[str]:
    """Return the text for a person."""
    grid, changed = about['grid'], _changed(about['parameters'])
    facts = [
        ('bag', f'{about["bag"]} ({about["kind"]}, {about["state"]})'),
        ('folder', f'{about["path"]}, {size_text(about["size"])}'),
        ('began', time_text(about['begun'])),
        ('drive', f'{about["duration"]:.2f} s, stamps from {about["start"]:.3f} s'),
        *_extent(way),
        ('workspace', grid_text(Grid(**grid)) + (
            ' when it began; it fits itself' if about['fitted'] else '')),
        ('parameters', ', '.join(changed) or 'defaults'),
        *([('taken over', about['imported'])] if about['imported'] else []),
        *([('before it', about['before_the_drive'])] if about['before_the_drive'] else []),
        *([('outcome', about['outcome'])] if about['outcome'] else []),
        *([('label', about['label'])] if about['label'] else []),
        *([('note', about['note'])] if about['note'] else [])]
    topics = [('topic', 'type', 'messages'), *(
        (each['topic'], each['type'], str(each['messages'])) for each in about['topics'])]
    drawing = drawing_lines(*way)
    return [*_content_lines(about), *drawing, *([''] if drawing else []), *table_lines(facts), '',
            *table_lines(topics, (2,))]


def _extent(way: Way) -> list[tuple[str, str]]:
    """Say how far a drive reaches."""
    path = way[0]
    if not len(path):
        return []
    (x, y), (high_x, high_y) = path.min(axis=0), path.max(axis=0)
    return [('extent', f'x from {x:.2f} to {high_x:.2f} m, y from {y:.2f} to {high_y:.2f} m')]


def _changed(parameters: dict[str, Any]) -> list[str]:
    """Name the parameters that are not the defaults."""
    defaults = asdict(Parameters())
    return [f'{name}: {value}' for name, value in parameters.items() if value != defaults[name]]


def _content_lines(about: dict[str, Any]) -> list[str]:
    if 'demonstration' in about:
        shown = about['demonstration']
        loops = [f'  {loop["first"] - about["start"]:7.2f} s to '
                 f'{loop["last"] - about["start"]:.2f} s  a loop of '
                 f'{counted(loop["n_cells"], "cell")}, {loop["length"]:.1f} m, from '
                 f'({loop["place"][0]:.2f}, {loop["place"][1]:.2f}) m back to it: cut out'
                 for loop in shown['report']['loops']]
        places = ' to '.join('({:.2f}, {:.2f})'.format(*shown[end]) for end in ('start', 'goal'))
        cut_out = sum(loop['n_cells'] for loop in shown['report']['loops'])
        drove = (f'{about["bag"]}: a person drove from (x, y) = {places} m, '
                 f'{counted(max(about["cells"] - cut_out - 1, 0), "step")} to learn from')
        return [drove, *loops,
                f'in numbers: {_numbers(shown["report"])}', '']
    if 'decisions' not in about:
        return []
    made = about['decisions']
    kinds = ', '.join(f'{n} {kind}' for kind, n in made['kinds'].items())
    counts = (f'in numbers: {counted(made["count"], "decision")}: {kinds or "none"}; '
              f'{counted(made["reinforcements"], "reinforcement")} to learn from, '
              f'{made["online_reinforcements"]} given under way, in sum {made["reward"]:+d}')
    return [f'{about["bag"]}: {_way(about, made)}', *map(_event_line, made['notable']), counts,
            '']


def _numbers(report: dict[str, Any]) -> str:
    return DemonstrationReport(**{**report, 'loops': (), 'cuts': ()}).numbers()


def _way(about: dict[str, Any], made: dict[str, Any]) -> str:
    """Say in a sentence what the robot did in a trial."""
    n = made['kinds'].get('blocked', 0)
    met = f'; {counted(n, "time")} something was in its way' if n else ''
    ended = how_it_ended(about['outcome'], about['steps']) if about['outcome'] else 'was driving'
    return f'the robot {ended}{met}' + (':' if made['notable'] else '')


def _event_line(event: dict[str, Any]) -> str:
    x, y = event['place']
    done = _DONE[event['kind']].format(DIRECTIONS[event['heading']])
    return f'  {event["at"]:7.2f} s  at ({x:.2f}, {y:.2f}) m  {done} (reward {event["reward"]:+d})'
