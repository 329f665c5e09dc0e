"""
A trial among things that move, tick by tick; plain Python or compiled, as `kernels` says.

The robot drives from cell centre to cell centre, stands where something reaches into its own
cell or it would touch what moves, and waits as `waiting` says: its collision monitor is taken to
be perfect. Discs move as `Moving` lists it, and stand before the robot.
"""

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_LENGTH, STEP_ROW
from control_field.kernels.decision import (
    decide, n_rewards, Options, take_in_cells, TrialState, write_decision)
from control_field.kernels.steps import (
    _BLOCKED, BoolMap, CellMap, FloatMap, is_occupied, step_allowed)
from control_field.kernels.visibility import look, Scanner
from control_field.kernels.waiting import comes_into_the_way

Whole = npt.NDArray[np.int64]

#: Discs that overlap by more, [cells], began so: they part freely.
_BEGAN_SO: Final = -1e-6
#: A robot that has stood so many ticks in one place stands for good.
_FOR_GOOD: Final = 3000
#: Multiples of it leave remainders that are spread evenly.
_GOLDEN: Final = 0.6180339887498949
#: How often a robot to which no way is left waits, and looks whether what has come has gone.
_LOOKS: Final = 6
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
    truth, room : ndarray of int8, shape (n_rows, n_cols)
        What stands where, and where there was room as the robot knows.
    came : ndarray of bool, shape (n_rows, n_cols)
        Where something has come and was not seen to go.
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
    room: CellMap
    came: BoolMap
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
    return Scene(
        moving, truth.copy(), known.copy(), np.zeros(truth.shape, dtype=np.bool_),
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


def see_moving(scene: Scene, row: int, col: int, flips: float, rng: np.random.Generator) -> int:
    """Return the mask of the cells around one that are shown as blocked; outside all are."""
    mask = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        blocked = is_occupied(scene.truth, r, c, False) or mover_in(scene, r, c)
        if flips > 0.0 and rng.random() < flips:
            blocked = not blocked
        if blocked:
            mask |= 1 << heading
    return mask


def take_in(room: CellMap, came: BoolMap, row: int, col: int, blocked: int) -> None:
    """Take in what is seen: where there was room, there may be again."""
    room[row, col] = 0
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if 0 <= r < room.shape[0] and 0 <= c < room.shape[1]:
            is_blocked = blocked >> heading & 1 == 1
            came[r, c] = is_blocked and (came[r, c] or room[r, c] == 0)
            if not is_blocked:
                room[r, c] = 0
            elif room[r, c] != 0:
                room[r, c] = _BLOCKED


def believe(room: CellMap, row: int, col: int, blocked: int) -> None:
    """Take what is seen blocked for something that stays."""
    for heading in range(8):
        r, c = row + STEP_ROW[heading], col + STEP_COL[heading]
        if blocked >> heading & 1 and 0 <= r < room.shape[0] and 0 <= c < room.shape[1]:
            room[r, c] = _BLOCKED


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
    waited, heading = 0, int(trial.headings[row, col])
    for _ in range(_FOR_GOOD):
        blocked = see_moving(scene, row, col, pace.flips, rng)
        take_in(scene.room, scene.came, row, col, blocked)
        if not mover_in(scene, row, col):
            if heading < 0 or not comes_into_the_way(
                    scene.room, row, col, heading, blocked, trial.ground.rules):
                return blocked
            if waited >= pace.patience:
                believe(scene.room, row, col, blocked)
                return blocked
            waited += 1
        pass_tick(scene, pace.radius)
    return -1


def drive_step(
    scene: Scene, trial: TrialState, pace: Pace, row: int, col: int, heading: int,
    rng: np.random.Generator,
) -> int:
    """Drive to the next cell; return whether it arrived, turned back, is stuck or ran into."""
    rules, length = trial.ground.rules, STEP_LENGTH[heading]
    to_row, to_col = row + STEP_ROW[heading], col + STEP_COL[heading]
    done, waited = 0.0, 0
    for _ in range(_FOR_GOOD):
        blocked = see_moving(scene, row, col, pace.flips, rng)
        take_in(scene.room, scene.came, row, col, blocked)
        if comes_into_the_way(scene.room, row, col, heading, blocked, rules):
            if waited >= pace.patience:
                believe(scene.room, row, col, blocked)
                return go_back(scene, pace, row, col, heading, done)
            waited += 1
        elif not (mover_in(scene, row, col) if 2.0 * done < length
                  else mover_in(scene, to_row, to_col)):
            ahead = min(done + pace.speed, length)
            if ahead > 0.5 - pace.radius and not step_allowed(
                    scene.truth, row, col, heading, rules):
                return _HIT
            share = ahead / length
            if move_to(scene, row + 0.5 + share * (to_row - row),
                       col + 0.5 + share * (to_col - col), pace.radius):
                done = ahead
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


def look_again(scene: Scene, trial: TrialState, pace: Pace) -> bool:
    """Wait for what has come, where no way is left; return whether there is anything like that."""
    is_there = False
    for row in range(scene.came.shape[0]):
        for col in range(scene.came.shape[1]):
            if scene.came[row, col] and trial.ground.known[row, col] == _BLOCKED:
                scene.room[row, col] = 0
                trial.seen[row, col] = False
                is_there = True
    for _ in range(pace.patience if is_there else 0):
        pass_tick(scene, pace.radius)
    return is_there and pace.patience > 0


def run_moving_trial(
    scene: Scene, pace: Pace, trial: TrialState, options: Options, step_limit: int,
    rng: np.random.Generator, log: npt.NDArray[np.int32], scanner: Scanner,
) -> tuple[int, int, int, float, int]:
    """
    Run a trial from where the robot is; see `control_field.kernels.decision.run_trial`.

    Who turns back before what came into the way has made a step.

    Returns
    -------
    outcome : int
        0 goal, 1 ran into a wall (that it saw wrongly), 2 gave up.
    n_steps, n_rows : int
    length : float, [cells]
    n_reinforcements : int

    """
    row, col = int(scene.robot[0]), int(scene.robot[1])
    n_rows, n_reinforcements, n_looks, length = 0, 0, 0, 0.0
    for step in range(step_limit):
        if row == trial.goal[0] and col == trial.goal[1]:
            return 0, step, n_rows, length, n_reinforcements
        blocked = stand_before(scene, trial, pace, row, col, rng)
        if blocked < 0:
            return 2, step, n_rows, length, n_reinforcements
        if scanner.rays.shape[0]:
            look(scene.truth, row, col, scanner.rays, scanner.shown)
            take_in_cells(trial, row, col, scanner.shown)
        decision = decide(row, col, blocked, 0, trial, options, rng)
        n_rows = write_decision(log, n_rows, row, col, decision, blocked, step)
        n_reinforcements += n_rewards(decision)
        heading = decision.heading
        if heading < 0:
            n_looks += 1
            if options.doubts and n_looks <= _LOOKS and look_again(scene, trial, pace):
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
