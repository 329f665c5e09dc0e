"""What there is to say of a bag of another recorder, before anything is learnt from it."""

import argparse
from dataclasses import asdict
from pathlib import Path
import shlex
from typing import Any

import numpy as np
import numpy.typing as npt

from control_field.drives.breaks import place_text
from control_field.words import counted
from episode_store.external.survey import look_into, PoseSource, Survey
from episode_store.external.topic_roles import why_odom
from episode_store.rosbag2.any_reader import notes_on
from episode_store.rosbag2.bag_files import files_of_file, files_of_folder
from episode_store.rosbag2.topic_tables import pose_table
from experience_cli.bag_summary import demonstration_about, grid_text, size_text, time_text
from experience_cli.drive_drawing import drawing_lines
from experience_cli.external_bags import demo_header, reading_of
from experience_cli.terminal import table_lines

Way = tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]


def overview(arguments: argparse.Namespace, path: Path) -> Survey:
    """
    Look into a bag of another recorder as the options say.

    Raises
    ------
    UserError, BagError
        If an argument is wrong, or it cannot be read at all.

    """
    header, workspace = demo_header(arguments, None)
    return look_into(path, workspace, reading_of(arguments), header.speed_max)


def about_external(found: Survey, path: Path, is_named: bool) -> dict[str, Any]:
    """Return all of it, ready for JSON."""
    bag, drive, content = found.bag, found.drive, found.content
    first, last = bag.recorded or (0, 0)
    topics = [{'topic': topic, 'type': kind, 'messages': bag.counts[topic]}
              for topic, kind in sorted(bag.topics.items())]
    about = {
        'path': str(path), 'size': _size(path), 'begun': first * 1e-9 if first > 1e18 else None,
        'seconds': (last - first) * 1e-9, 'topics': topics,
        'sources': [_source_about(source) for source in found.sources],
        'learnt_from': drive.read_from if drive else None,
        'why': why_odom(bag, drive.read_from, is_named) if drive else None,
        'would_be_learnt': not found.refusal, 'refusal': found.refusal,
        'notes': list(found.notes if content else drive.notes if drive else notes_on(bag)),
        'grid': asdict(drive.grid) if drive else None}
    if drive is None or content is None:
        return about
    record, report = content
    return {**about, 'workspace': grid_text(drive.grid), 'is_fitted': drive.is_fitted,
            'doubts': report.sentences(),
            'steps': report.n_steps, 'demonstration': demonstration_about(
                record, report, drive.grid)}


def _size(path: Path) -> int:
    files = files_of_folder(path) if path.is_dir() else files_of_file(path)
    return sum(file.stat().st_size for file in files.paths)


def _source_about(source: PoseSource) -> dict[str, Any]:
    about: dict[str, Any] = {
        'topic': source.topic, 'type': source.type_name, 'frame': source.frame_id,
        'base': source.base, 'poses': len(source.seconds), 'problem': source.problem}
    if len(source.seconds):
        about |= {'seconds': source.duration, 'rate': source.rate, 'way': source.way,
                  'speed': source.speed, 'low': source.places.min(axis=0).tolist(),
                  'high': source.places.max(axis=0).tolist()}
    return about


def lines_from_external(about: dict[str, Any], way: Way) -> list[str]:
    """Return the text for a person."""
    path, sources = about['path'], about['sources']
    facts = [
        ('bag', f'{path}, {size_text(about["size"])}'),
        ('recorded', f'{time_text(about["begun"])}, {about["seconds"]:.1f} s'),
        *([('drive from', f'{about["learnt_from"]}: {about["why"]}')] if about['why'] else []),
        *([('workspace', about['workspace'] + (', which fits the drive' if (
            about['is_fitted']) else ''))] if about['would_be_learnt'] else []),
        *(('note', note) for note in about['notes'])]
    topics = [('topic', 'type', 'messages'), *(
        (each['topic'], each['type'], str(each['messages'])) for each in about['topics'])]
    return [
        *_head(about), '', *drawing_lines(*way), *([''] if len(way[0]) > 1 else []),
        *table_lines(facts), '', *(_source_lines(sources) if sources else []),
        *table_lines(topics, (2,))]


def _head(about: dict[str, Any]) -> list[str]:
    """Say in sentences what it is, and whether it would be learnt."""
    path = about['path']
    command = f'`experience learn {shlex.quote(path)}`'
    sources = [each for each in about['sources'] if each['poses']]
    used = next((each for each in sources if each['topic'] == about['learnt_from']), None)
    if used is None and len(sources) == 1:
        [used] = sources
    said = [f'{path}: {_drive_text(used)}'] if used else [f'{path}: a bag of another recorder']
    if not about['would_be_learnt']:
        return [*said, f'{command} does not learn it: {about["refusal"]}']
    shown = about['demonstration']
    ends = ' to '.join(f'{place_text(shown[end])} m' for end in ('start', 'goal'))
    return [*said, f'{command} learns it: {counted(about["steps"], "step")} from {ends}',
            *(f'  {doubt}' for doubt in about['doubts'])]


def _drive_text(used: dict[str, Any]) -> str:
    return (f'a drive of {used["seconds"]:.1f} s and {used["way"]:.1f} m in {used["frame"]!r}, '
            f'x from {used["low"][0]:.2f} to {used["high"][0]:.2f} m, y from {used["low"][1]:.2f} '
            f'to {used["high"][1]:.2f} m, up to {used["speed"]:.2f} m/s')


def _source_lines(sources: list[dict[str, Any]]) -> list[str]:
    rows = [('poses on', 'type', 'frame', 'poses', 'Hz', 's', 'x [m]', 'y [m]', 'z [m]',
             'way [m]', 'm/s')]
    rows += [(each['topic'], each['type'].rpartition('/')[2], each['frame'], str(each['poses']),
              f'{each["rate"]:.1f}', f'{each["seconds"]:.1f}', *(
                  f'{low:.2f} to {high:.2f}' for low, high in zip(
                      each['low'], each['high'], strict=True)),
              f'{each["way"]:.1f}', f'{each["speed"]:.2f}') for each in sources if each['poses']]
    problems = [f'{each["topic"]}: {each["problem"]}' for each in sources if each['problem']]
    lines = table_lines(rows, (3, 4, 5, 9, 10)) if len(rows) > 1 else []
    return [*lines, *problems, '']


def way_of(found: Survey) -> Way:
    """Return the way that would be learnt, or the best there is, and which of it is cut out."""
    if found.drive is None:
        places = max((source.places[:, :2] for source in found.sources), key=len,
                     default=np.zeros((0, 2)))
        return places, np.zeros(len(places), dtype=np.bool_)
    drive = found.drive
    poses = pose_table(drive.bag.messages(drive.topics['odom']), drive.grid.frame_id)
    loops = found.content[1].loops if found.content else ()
    cut = np.zeros(len(poses.stamps), dtype=np.bool_)
    for loop in loops:
        cut |= (poses.stamps >= loop.first) & (poses.stamps <= loop.last)
    order = np.argsort(poses.stamps, kind='stable')
    return poses.xy[order], cut[order]
