"""`experience explain`: why the robot did what it did at a moment of a bag."""

import argparse
from collections.abc import Mapping
import json
import math
from typing import Any, Final

from control_field.compass import DIRECTIONS
from control_field.local_grid import BLOCKED
from control_field.robot.limits import Limits
from control_field_node.settings import Settings
from episode_store.episode import Episode
from episode_store.explanation import check_recorded, Moment
from episode_store.moment_report import about_moment
from experience_cli.arguments import LIMITS
from experience_cli.bag_summary import say_cut, say_gaps
from experience_cli.errors import UserError
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
        check_recorded(episode, arguments.at)
        about = about_moment(Moment(episode, arguments.at, limits))
        say_cut('explain', episode)
        say_gaps('explain', episode)
    print(json.dumps(about, indent=2) if arguments.json else '\n'.join(lines_from(about)))
    return 1 if about['course'] and not about['course']['adds_up'] else 0


def _limits(arguments: argparse.Namespace) -> Limits:
    given = {name: getattr(arguments, name) for name in (*LIMITS, 'footprint')
             if getattr(arguments, name) is not None}
    try:
        return Settings(**given).limits
    except ValueError as error:
        raise UserError(f"the robot's {error}") from None


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
