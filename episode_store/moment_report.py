"""All there is to say of a moment of a bag, as JSON holds it; who shows it finds the words."""

import math
from typing import Any, Final

from control_field.compass import COMPASS, compass
from control_field.headings import heading_from_vector, STEP_COL, STEP_ROW
from control_field.learning.provenance import vector_at, Voices
from control_field.records import ControlField, Kind
from control_field.robot.footprint import text_from_points
from control_field.robot.limits import Limits
from episode_store.explanation import ExplainedHeading, Moment
from episode_store.sources import Sources

#: Of a body, by the name of the controller's parameter.
_LIMITS: Final = {'v_max': 'v_max', 'w_max': 'w_max', 'a_max': 'a_max', 'alpha_max': 'alpha_max',
                  'robot_radius': 'radius'}


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
        'limits': limits_about(limits),
        'gate': monitored and {'velocity': list(monitored.velocity), 'rule': monitored.rule,
                           'reproduces': monitored.reproduces}}


def limits_about(limits: Limits) -> dict[str, Any]:
    """Return the limits of a body by the names of the controller's parameters."""
    outline = limits.footprint
    return {name: getattr(limits, attribute) for name, attribute in _LIMITS.items()} | (
        {'footprint': text_from_points(outline.corners)} if outline else {})


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
