"""`experience explain`: why the robot did what it did at a moment of a bag."""

import argparse
from collections.abc import Mapping
import json
import math
from typing import Any, Final

from control_field.headings import heading_from_vector, STEP_COL, STEP_ROW
from control_field.learning.provenance import vector_at, Voices
from control_field.local_grid import BLOCKED
from control_field.records import ControlField, Kind
from control_field.robot.footprint import text_from_points
from control_field.robot.limits import Limits
from control_field_node.settings import Settings
from episode_store.episode import Episode
from episode_store.sources import Sources
from experience_cli.arguments import LIMITS
from experience_cli.bag_summary import say_cut, say_gaps
from experience_cli.compass import COMPASS, compass, DIRECTIONS
from experience_cli.errors import UserError
from experience_cli.explanation import ExplainedHeading, Moment
from experience_cli.external_bags import bag_of
from experience_cli.terminal import table_lines

#: Prototypes that the text names; JSON has all of them.
_MOST = 12
_NO_SHARES = {
    True: 'this trial was to look around: its heading is the shortest way that shows unseen '
          'cells, no prototype had a say',
    False: 'its prototypes do not make up this vector: bags that it was learnt from are missing '
           'or have changed'}
#: What the robot does, by the kind of its decision.
_DOES: Final[Mapping[str, str]] = {
    'field': 'The robot drives {}, as it has learnt',
    'blocked': 'The robot does not drive {}: something is in the way',
    'avoid': 'The robot drives {}, around something in its way',
    'explore': 'The robot tries {}, to get out of a circle',
    'taught': 'A person drives the robot {}',
    'detour': 'The robot drives {}: the way ahead is known to be blocked farther on'}


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return 1 if the shares do not make up the field's vector."""
    if not math.isfinite(arguments.at):
        raise UserError(f'--at {arguments.at}: must be a number of seconds')
    limits = _limits(arguments)
    with bag_of(arguments) as folder:
        episode = Episode(folder)
        _check_recorded(episode, arguments.at)
        about = about_moment(Moment(episode, arguments.at, limits))
        say_cut('explain', episode)
        say_gaps('explain', episode)
    print(json.dumps(about, indent=2) if arguments.json else '\n'.join(lines_from(about)))
    return 1 if about['course'] and not about['course']['adds_up'] else 0


def _check_recorded(episode: Episode, at: float) -> None:
    """Refuse a moment at which nothing was recorded."""
    # What lies past the end of the drive may be a stamp.
    second = at if at <= episode.duration + 1e-6 else at - episode.start
    hole = episode.gaps.hole_at(second)
    if hole is not None:
        raise UserError(f'{episode.folder.name} at {second:.2f} s: there is nothing to '
                        f'explain, the recording is incomplete: {hole}')


def _limits(arguments: argparse.Namespace) -> Limits:
    given = {name: getattr(arguments, name) for name in (*LIMITS, 'footprint')
             if getattr(arguments, name) is not None}
    try:
        return Settings(**given).limits
    except ValueError as error:
        raise UserError(f"the robot's {error}") from None


def about_moment(moment: Moment) -> dict[str, Any]:
    """
    Return all there is to say of a moment, ready for JSON.

    Raises
    ------
    BagError
        If the bag cannot be read.

    """
    status = moment.status
    return {
        'bag': moment.episode.folder.name, 'kind': str(moment.episode.folder.kind),
        'at': round(moment.seconds, 6), 'stamp': moment.stamp, 'pose': list(moment.pose),
        'robot_cell': list(moment.robot_cell), 'cell': list(moment.cell),
        'place': list(moment.header.grid.world_from_cell(*moment.cell)),
        'trial': None if status is None else {
            'number': status.trial, 'state': str(status.state), 'reason': status.reason},
        'decision': [_row(row, moment) for row in moment.decisions],
        'command': _command(moment), 'course': _explained_heading(moment),
        'no_course': moment.no_heading if moment.heading is None else None}


def _command(moment: Moment) -> dict[str, Any]:
    monitored, limits = moment.monitored, moment.limits
    return {
        'requested': _finite(moment.requested), 'applied': _finite(moment.applied),
        'clipped_by': moment.clipped_by, 'at_limits': moment.at_limits,
        'limits': {name: getattr(limits, name.removeprefix('robot_')) for name in LIMITS} | (
            {'footprint': text_from_points(limits.footprint.corners)}
            if limits.footprint else {}),
        'gate': monitored and {'velocity': list(monitored.velocity), 'rule': monitored.rule,
                           'reproduces': monitored.reproduces}}


def _finite(velocity: tuple[float, float] | None) -> list[float | None] | None:
    """Return a velocity as JSON can hold it: null for what is no number."""
    return velocity and [value if math.isfinite(value) else None for value in velocity]


def _row(row: Any, moment: Moment) -> dict[str, Any]:
    return {
        'kind': Kind(int(row['kind'])).name.lower(), 'heading': compass(int(row['action'])),
        'reward': int(row['reward']), 'at': round(float(row['stamp']) - moment.episode.start, 6),
        'cell': [int(row['row']), int(row['col'])],
        'place': list(moment.header.grid.world_from_cell(int(row['row']), int(row['col']))),
        'next_cell': [int(row['next_row']), int(row['next_col'])],
        'sight_blocked': [compass(h) for h in range(8) if int(row['blocked']) >> h & 1],
        'sight_unknown': [compass(h) for h in range(8) if int(row['unknown']) >> h & 1],
        'field_revision': int(row['revision'])}


def _explained_heading(moment: Moment) -> dict[str, Any] | None:
    heading = moment.heading
    if heading is None:
        return None
    field, cell, voices = heading.field, heading.cell, heading.voices
    x, y = vector_at(field, *cell)
    index = heading_from_vector(x, y) if (x, y) != (0.0, 0.0) else -1
    return {
        'source': heading.source, 'revision': field.revision, 'vector': [x, y],
        'coherence': float(field.coherence[cell]), 'heading': compass(index),
        'known': int(field.known[cell]), 'known_ahead': _known_ahead(field, cell, index),
        'q': {name: float(value) for name, value in zip(COMPASS, field.q[cell], strict=True)},
        'adds_up': voices is not None or heading.source == 'curious',
        'sum': list(voices.vector) if voices else None,
        'pull': None if voices is None or voices.attraction < 0 else {
            'heading': compass(voices.attraction), 'weight': voices.attraction_weight,
            'share': voices.attraction_share},
        'prototypes': [] if voices is None else _voices(moment, heading, voices)}


def _known_ahead(field: ControlField, cell: tuple[int, int], heading: int) -> int | None:
    """Return the remembered map where a heading leads; None if nowhere in the workspace."""
    if heading < 0:
        return None
    row, col = cell[0] + int(STEP_ROW[heading]), cell[1] + int(STEP_COL[heading])
    return int(field.known[row, col]) if field.grid.contains(row, col) else None


def _voices(moment: Moment, heading: ExplainedHeading, voices: Voices) -> list[dict[str, Any]]:
    sources = Sources(moment.episode.folder.task)
    table, found = heading.prototypes, []
    # As the moment's own cell is given, in cells of the bag's header.
    off = heading.cell[0] - moment.cell[0], heading.cell[1] - moment.cell[1]
    for i, distance, weight, share in zip(
            voices.indices.tolist(), voices.distances.tolist(), voices.weights.tolist(),
            voices.shares.tolist(), strict=True):
        number, stamp = int(table.episodes[i]), float(table.stamps[i])
        demonstrated = bool(table.demonstrated[i])
        found.append({
            'share': share, 'weight': weight, 'distance': distance,
            'cell': (table.cells[i] - off).tolist(),
            'place': list(heading.field.grid.world_from_cell(*table.cells[i].tolist())),
            'heading': compass(int(table.headings[i])),
            'q': float(table.q[i]), 'demonstrated': demonstrated, 'episode': number,
            'second': sources.second(number, stamp) if number > 0 else None,
            'stamp': None if math.isnan(stamp) else stamp,
            'from': sources.text(number, stamp, demonstrated)})
    return found


def lines_from(about: dict[str, Any]) -> list[str]:
    """Return the text for a person."""
    x, y, yaw = about['pose']
    where = f'robot at ({x:.3f}, {y:.3f}) m, {math.degrees(yaw):.0f} degrees'
    lines = [
        plain_sentence(about),
        f'{about["bag"]} ({about["kind"]}) at {about["at"]:.2f} s, stamp {about["stamp"]:.3f} s',
        where, *_trial_lines(about['trial']), *map(_decision_line, about['decision']),
        *_command_lines(about['command'])]
    if not about['decision']:
        lines.append('no decision: a person drove' if about['kind'] == 'demo' else
                     'no decision was made yet')
    return lines + _heading_lines(about)


def plain_sentence(about: dict[str, Any]) -> str:
    """Say in plain words what the robot did, and where it has that from."""
    decisions, heading = about['decision'], about['course']
    if not decisions:
        return ('A person drove here.' if about['kind'] == 'demo' else
                'The robot had decided nothing yet.')
    last = decisions[-1]
    said = _DOES[last['kind']].format(DIRECTIONS[last['heading']])
    voices = heading['prototypes'] if heading is not None else []
    if last['kind'] != 'field' or not voices:
        return f'{said}.'
    return f'{said}: {voices[0]["share"]:.0%} of that comes from {voices[0]["from"]}.'


def _place(thing: dict[str, Any]) -> str:
    return '({:.2f}, {:.2f}) m'.format(*thing['place'])


def _trial_lines(trial: dict[str, Any] | None) -> list[str]:
    if trial is None:
        return []
    why = f': {trial["reason"]}' if trial['reason'] else ''
    what = f'trial {trial["number"]}' if trial['number'] else 'demonstration'
    return [f'{what} {trial["state"]}{why}']


def _decision_line(row: dict[str, Any]) -> str:
    said = {
        'field': 'the heading of the field, {heading}',
        'blocked': 'the heading {heading} was refused: the local grid showed it blocked',
        'avoid': '{heading} by the Q-matrix, instead of the blocked heading',
        'explore': '{heading} at random, to leave an oscillation',
        'taught': '{heading}, driven by a person',
        'detour': '{heading} by the Q-matrix: the heading is free here and known to fail later'}
    blocked = ' '.join(row['sight_blocked']) or 'nothing'
    return (f'decision at {row["at"]:.2f} s around {_place(row)}: '
            f'{said[row["kind"]].format(heading=row["heading"])} (reward {row["reward"]:+d}, '
            f'blocked in sight: {blocked})')


def _command_lines(command: dict[str, Any]) -> list[str]:
    if command['applied'] is None:
        return ['no command was recorded here']
    line = f'command: {_velocity_text(command["applied"])}'
    if command['at_limits']:
        line += (f' (no less than {_body(command["limits"])} can: '
                 f'{", ".join(command["at_limits"])})')
    if command['requested'] is None:
        return [line]
    monitored = command['gate']
    if monitored is None:
        return [line + ', as it was asked for']
    line += f'; {_velocity_text(command["requested"])} was asked for, '
    if monitored['reproduces']:
        body = _body(command['limits'])
        return [f'{line}the collision monitor says: {monitored["rule"]} (for {body})']
    return [line + 'what the collision monitor did is not known:', _unexplained(command)]


def _unexplained(command: dict[str, Any]) -> str:
    monitored = command['gate']
    rule = 'as it was asked for' if monitored['rule'] == 'none' else monitored['rule']
    return (f'  for {_body(command["limits"])} at the recorded pose it would have let through '
            f'{_velocity_text(monitored["velocity"])} ({rule}); the robot\'s limits may be others '
            f'(name them: {", ".join("--" + name.replace("_", "-") for name in LIMITS)}), or '
            f'its pose was mended by a localisation or by anchoring')


def _body(limits: dict[str, Any]) -> str:
    """Name the body that limits were taken of."""
    usual = Limits()
    given = [f'{name} {value}' if isinstance(value, str) else f'{name} {value:g}'
             for name, value in limits.items()
             if value != getattr(usual, name.removeprefix('robot_'))]
    return f'a robot with {", ".join(given)}' if given else 'a TurtleBot3 Burger'


def _velocity_text(velocity: list[float | None]) -> str:
    v, w = ('no number' if value is None else f'{value:.3f}' for value in velocity)
    return f'{v} m/s, {w} rad/s'


def _heading_lines(about: dict[str, Any]) -> list[str]:
    heading = about['course']
    if heading is None:
        return [about['no_course']]
    x, y = heading['vector']
    there = (f'field revision {heading["revision"]} around {_place(about)}: vector '
             f'({x:+.4f}, {y:+.4f}), heading {heading["heading"]}, coherence '
             f'{heading["coherence"]:.3f}')
    lines = [there, 'Q there: ' + '  '.join(
        f'{name} {q:+.3f}' for name, q in heading['q'].items())]
    if 0 < (heading['known_ahead'] or 0) < BLOCKED:
        lines.append(f'where that leads was blocked when it was seen last; it is in doubt by now '
                     f'(confidence {heading["known_ahead"]} of 100), so the robot goes and looks')
    if heading['sum'] is None:
        return [*lines, _NO_SHARES[heading['source'] == 'curious']]
    return lines + _share_lines(heading)


def _share_lines(heading: dict[str, Any]) -> list[str]:
    rows = [('share', 'weight', 'cells off', 'place', 'heading', 'Q', 'from')]
    voices = heading['prototypes']
    rows += [(f'{voice["share"]:.1%}', f'{voice["weight"]:.4f}', f'{voice["distance"]:.2f}',
              _place(voice), voice['heading'], f'{voice["q"]:+.3f}', voice['from'])
             for voice in voices[:_MOST]]
    attraction = heading['pull']
    if attraction:
        rows.append((f'{attraction["share"]:.1%}', f'{attraction["weight"]:.4f}', '1.00', '-',
                     attraction['heading'], '-', 'the pull towards the shortest known way'))
    lines = table_lines(rows, (0, 1, 2, 5))
    if len(voices) > _MOST:
        rest = sum(voice['share'] for voice in voices[_MOST:])
        lines.append(f'{rest:>6.1%}  of {len(voices) - _MOST} more')
    x, y = heading['sum']
    return [*lines, f"together: ({x:+.4f}, {y:+.4f}), which is the field's vector"]
