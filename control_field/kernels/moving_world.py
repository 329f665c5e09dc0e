"""
A trial among things that move, tick by tick; plain Python or compiled, as `kernels` says.

The robot drives from cell centre to cell centre, stands where something reaches into its own
cell or it would touch what moves, and waits, looks again and gives up as `waiting` says: its
collision monitor is taken to be perfect. Discs move as `Moving` lists it, and stand before the
robot. While the robot drives it sees the cells around it, for each decision all that is in sight.
"""

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.decision import (
    decide, Log, n_rewards, Options, take_in_cells, TrialState, write_decision, write_shown)
from control_field.kernels.steps import _BLOCKED, _UNKNOWN, CellMap, FloatMap, step_allowed
from control_field.kernels.visibility import look, Scanner
from control_field.kernels.waiting import (
    CLEAR, GIVE_UP, LOOK, look_again, look_ahead, new_record, STAYS, take_in, WAIT, WayRecord)

Whole = npt.NDArray[np.int64]

#: Discs that overlap by more, [cells], began so: they part freely.
_BEGAN_SO: Final = -1e-6
#: A robot that has stood so many ticks in one place stands for good.
_FOR_GOOD: Final = 3000
#: Multiples of it leave remainders that are spread evenly.
_GOLDEN: Final = 0.6180339887498949
_ARRIVED, _TURNED_BACK, _STUCK, _HIT = 0, 1, 2, 3


class Moving(NamedTuple):
    """
    What moves and what changes, in ticks.

    Parameters
    ----------
    places : ndarray of float64, shape (n_ticks, n_movers, 2), [cells]
        Row and column of the centre of each disc, by its own time (the middle of cell (0, 0) is at
        0.5, 0.5); NaN while it is not there.
    radius : ndarray of float64, shape (n_movers,), [cells]
    patience : ndarray of int64, shape (n_movers,), [ticks]
        How long each stands before the robot until it turns back, give or take a half; 0: for
        ever.
    events : ndarray of int64, shape (n_events, 4)
        Tick of the trial, row, column and what the cell becomes (0 or 100).

    """

    places: FloatMap
    radius: FloatMap
    patience: Whole
    events: Whole


class Pace(NamedTuple):
    """
    How the robot drives.

    Parameters
    ----------
    speed : float, [cells a tick]
    radius : float, [cells]
    patience : int, [ticks]
        How long it waits for what comes into its way; 0: never.
    flips : float
        Share of the cells it sees that are shown wrongly, at random.

    """

    speed: float
    radius: float
    patience: int
    flips: float


class Scene(NamedTuple):
    """
    A trial among movers as it stands; its arrays are changed in place.

    Parameters
    ----------
    truth, painted : ndarray of int8, shape (n_rows, n_cols)
        What stands where, and the same with what moves, as it was looked at last.
    way : WayRecord
    around : Scanner
        Of the cells around the robot.
    at, direction, held : ndarray of int64, shape (n_movers,)
        Own tick of each mover, whether it goes on (1) or back (-1), and how long it has stood.
    touching : ndarray of bool, shape (n_movers,)
    robot : ndarray of float64, shape (2,), [cells]
        Row and column.
    counts : ndarray of int64, shape (2,)
        Ticks, and how often a mover ran into the robot.

    """

    moving: Moving
    truth: CellMap
    painted: CellMap
    way: WayRecord
    around: Scanner
    at: Whole
    direction: Whole
    held: Whole
    touching: npt.NDArray[np.bool_]
    robot: FloatMap
    counts: Whole


def new_scene(
    moving: Moving, truth: CellMap, known: CellMap, start: tuple[int, int], begin: int,
) -> Scene:
    """Return a trial at its beginning; movers have their own tick ``begin`` then."""
    n = moving.radius.shape[0]
    robot = np.array([start[0] + 0.5, start[1] + 0.5])
    around = Scanner(np.zeros((0, 0, 2), dtype=np.int16), np.zeros((3, 3), dtype=np.int8))
    return Scene(
        moving, truth.copy(), truth.copy(), new_record(known), around,
        np.full(n, begin, dtype=np.int64), np.ones(n, dtype=np.int64),
        np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_), robot,
        np.zeros(2, dtype=np.int64))


def reaches_into(x: float, y: float, radius: float, row: int, col: int) -> bool:
    """Return whether a disc at row x and column y, in cells, reaches into a cell."""
    away_x = max(row - x, 0.0, x - row - 1.0)
    away_y = max(col - y, 0.0, y - col - 1.0)
    return away_x * away_x + away_y * away_y < radius * radius


def mover_in(scene: Scene, row: int, col: int) -> bool:
    """Return whether something that moves reaches into a cell."""
    for m in range(scene.at.shape[0]):
        x, y = scene.moving.places[scene.at[m], m]
        if reaches_into(x, y, scene.moving.radius[m], row, col):
            return True
    return False


def paint_movers(scene: Scene) -> None:
    """Paint the map with what moves as it is now."""
    scene.painted[:] = scene.truth
    rows, cols = scene.truth.shape
    for m in range(scene.at.shape[0]):
        x, y = scene.moving.places[scene.at[m], m]
        radius = scene.moving.radius[m]
        if math.isnan(x):
            continue
        for row in range(max(int(x - radius), 0), min(int(x + radius) + 1, rows)):
            for col in range(max(int(y - radius), 0), min(int(y + radius) + 1, cols)):
                if reaches_into(x, y, radius, row, col):
                    scene.painted[row, col] = _BLOCKED


def see_moving(
    scene: Scene, row: int, col: int, scanner: Scanner, flips: float, rng: np.random.Generator,
) -> int:
    """See what is in sight of a cell and take it in; return the mask of the blocked around it."""
    paint_movers(scene)
    look(scene.painted, row, col, scanner.rays, scanner.shown)
    if flips > 0.0:
        flip(scanner.shown, flips, rng)
    take_in(scene.way, row, col, scanner.shown)
    return int(scene.way.glance[2])


def flip(shown: CellMap, share: float, rng: np.random.Generator) -> None:
    """Show a share of what is seen wrongly, in place."""
    for row in range(shown.shape[0]):
        for col in range(shown.shape[1]):
            if shown[row, col] != _UNKNOWN and rng.random() < share:
                shown[row, col] = _BLOCKED - shown[row, col]


def gap_to(scene: Scene, m: int, tick: int, radius: float) -> float:
    """Return the room between the robot and a mover at a tick of its own; NaN without it."""
    x, y = scene.moving.places[tick, m]
    away = math.hypot(x - scene.robot[0], y - scene.robot[1])
    return float(away - radius - scene.moving.radius[m])


def pass_tick(scene: Scene, radius: float) -> None:
    """Let a tick pass for all that moves and changes; the robot stands."""
    scene.counts[0] += 1
    for m in range(scene.at.shape[0]):
        pass_tick_of(scene, m, radius)
    events = scene.moving.events
    for e in range(events.shape[0]):
        tick, row, col, state = events[e]
        if tick <= scene.counts[0] and (state == 0 or not reaches_into(
                scene.robot[0], scene.robot[1], radius, row, col)):
            scene.truth[row, col] = state


def patience_share(time: float) -> float:
    """
    Return how much of its patience a mover has at a time of its own: a half to one and a half.

    Two that always took the same time would step into each other's way for ever.
    """
    return 0.5 + time * _GOLDEN % 1.0


def pass_tick_of(scene: Scene, m: int, radius: float) -> None:
    """Let a mover go on for a tick, or stand before the robot."""
    moving, last = scene.moving, scene.moving.places.shape[0] - 1
    ahead = min(max(scene.at[m] + scene.direction[m], 0), last)
    now, then = gap_to(scene, m, scene.at[m], radius), gap_to(scene, m, ahead, radius)
    if not then < 0.0 or then >= now or now < _BEGAN_SO:
        scene.at[m], scene.held[m], scene.touching[m] = ahead, 0, False
        if ahead == 0 or (scene.direction[m] < 0 and math.isnan(moving.places[ahead, m, 0])):
            scene.direction[m] = 1
        return
    if math.isnan(now):  # it does not come where the robot stands
        return
    if not scene.touching[m]:
        scene.touching[m] = True
        scene.counts[1] += 1
    scene.held[m] += 1
    if 0 < moving.patience[m] * patience_share(scene.at[m]) <= scene.held[m]:
        scene.direction[m], scene.held[m] = -scene.direction[m], 0


def move_to(scene: Scene, row: float, col: float, radius: float) -> bool:
    """Move the robot a little, unless it would run into what it sees; return whether it moved."""
    before = scene.robot.copy()
    for m in range(scene.at.shape[0]):
        scene.robot[0], scene.robot[1] = before
        now = gap_to(scene, m, scene.at[m], radius)
        scene.robot[0], scene.robot[1] = row, col
        then = gap_to(scene, m, scene.at[m], radius)
        if then < 0.0 and then < now:
            scene.robot[0], scene.robot[1] = before
            return False
    scene.robot[0], scene.robot[1] = row, col
    return True


def stand_before(
    scene: Scene, trial: TrialState, pace: Pace, row: int, col: int, rng: np.random.Generator,
) -> int:
    """Wait as long as it is worth it; return the mask that is then seen blocked, -1: for good."""
    for _ in range(_FOR_GOOD):
        blocked = see_moving(scene, row, col, scene.around, pace.flips, rng)
        ahead = look_ahead(
            scene.way, float(scene.counts[0]), float(pace.patience), row, col,
            int(trial.headings[row, col]), trial.ground.rules)
        if ahead != WAIT and not mover_in(scene, row, col):
            return blocked
        pass_tick(scene, pace.radius)
    return -1


def drive_step(
    scene: Scene, trial: TrialState, pace: Pace, row: int, col: int, heading: int,
    rng: np.random.Generator,
) -> int:
    """Drive to the next cell; return whether it arrived, turned back, is stuck or ran into."""
    rules, length = trial.ground.rules, STEP_LENGTH[heading]
    to_row, to_col = row + STEP_ROW[heading], col + STEP_COL[heading]
    done = 0.0
    for _ in range(_FOR_GOOD):
        see_moving(scene, row, col, scene.around, pace.flips, rng)
        ahead = look_ahead(
            scene.way, float(scene.counts[0]), float(pace.patience), row, col, heading, rules)
        if ahead == STAYS:
            return go_back(scene, pace, row, col, heading, done)
        if ahead == CLEAR and not (mover_in(scene, row, col) if 2.0 * done < length
                                   else mover_in(scene, to_row, to_col)):
            goal = min(done + pace.speed, length)
            if goal > 0.5 - pace.radius and not step_allowed(
                    scene.truth, row, col, heading, rules):
                return _HIT
            share = goal / length
            if move_to(scene, row + 0.5 + share * (to_row - row),
                       col + 0.5 + share * (to_col - col), pace.radius):
                done = goal
        pass_tick(scene, pace.radius)
        if done >= length:
            return _ARRIVED
    return _STUCK


def go_back(scene: Scene, pace: Pace, row: int, col: int, heading: int, done: float) -> int:
    """Drive back to the middle of the cell that a step began in."""
    length = STEP_LENGTH[heading]
    for _ in range(_FOR_GOOD):
        if done <= 0.0:
            return _TURNED_BACK
        ahead = max(done - pace.speed, 0.0)
        if not mover_in(scene, row, col) and move_to(
                scene, row + 0.5 + ahead / length * STEP_ROW[heading],
                col + 0.5 + ahead / length * STEP_COL[heading], pace.radius):
            done = ahead
        pass_tick(scene, pace.radius)
    return _STUCK


def goes_on(
    scene: Scene, trial: TrialState, pace: Pace, row: int, col: int, rng: np.random.Generator,
) -> bool:
    """Return whether a trial to which no way is left goes on, once it has waited."""
    after = look_again(scene.way, float(pace.patience), trial.ground.known, trial.seen)
    for _ in range(pace.patience if after == LOOK else 0):
        see_moving(scene, row, col, scene.around, pace.flips, rng)
        pass_tick(scene, pace.radius)
    return after != GIVE_UP


def run_moving_trial(
    scene: Scene, pace: Pace, trial: TrialState, options: Options, step_limit: int,
    rng: np.random.Generator, log: Log, scanner: Scanner,
) -> tuple[int, int, int, float, int]:
    """
    Run a trial from where the robot is; see `control_field.kernels.decision.run_trial`.

    Who turns back before what came into the way, or looks again where no way is left, has made a
    step.

    Returns
    -------
    outcome : int
        0 goal, 1 ran into a wall (that it saw wrongly), 2 gave up.
    n_steps, n_rows : int
    length : float, [cells]
    n_reinforcements : int

    """
    row, col = int(scene.robot[0]), int(scene.robot[1])
    n_rows, n_reinforcements, length = 0, 0, 0.0
    for step in range(step_limit):
        if row == trial.goal[0] and col == trial.goal[1]:
            return 0, step, n_rows, length, n_reinforcements
        blocked = stand_before(scene, trial, pace, row, col, rng)
        if blocked < 0:
            return 2, step, n_rows, length, n_reinforcements
        if scanner.rays.shape[0]:
            blocked = see_moving(scene, row, col, scanner, pace.flips, rng)
            take_in_cells(trial, row, col, scanner.shown)
            write_shown(log, n_rows, scanner)
        decision = decide(row, col, blocked, 0, trial, options, rng)
        n_rows = write_decision(log.rows, n_rows, row, col, decision, blocked, step)
        n_reinforcements += n_rewards(decision)
        heading = decision.heading
        if heading < 0:
            if options.doubts and goes_on(scene, trial, pace, row, col, rng):
                continue
            return 2, step, n_rows, length, n_reinforcements
        end = drive_step(scene, trial, pace, row, col, heading, rng)
        if end in (_HIT, _STUCK):
            return 1 if end == _HIT else 2, step, n_rows, length, n_reinforcements
        if end == _ARRIVED:
            row, col = row + STEP_ROW[heading], col + STEP_COL[heading]
            length += STEP_LENGTH[heading]
    reached = row == trial.goal[0] and col == trial.goal[1]
    return 0 if reached else 2, step_limit, n_rows, length, n_reinforcements
