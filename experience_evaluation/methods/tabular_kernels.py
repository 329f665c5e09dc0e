"""The loops of tabular reinforcement learning, compiled."""

from collections.abc import Callable
import heapq
from typing import Any, cast, NamedTuple, TypeVar

import numba
import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.int64]
Queue = list[tuple[float, int]]
#: Least change that prioritised sweeping follows up.
_THRESHOLD = 1e-4
Q_LEARNING, SARSA, DYNA_Q, SWEEPING, DYNA_Q_PLUS = 0, 1, 2, 3, 4
_Kernel = TypeVar('_Kernel', bound=Callable[..., Any])


class Settings(NamedTuple):
    """
    What is learnt, and how; places are numbered row by row.

    Parameters
    ----------
    kind : int
        `Q_LEARNING`, `SARSA`, `DYNA_Q`, `SWEEPING` or `DYNA_Q_PLUS`.
    n_cols : int
        Places in a row.
    goal : int
        Place where an episode ends.
    mask : int
        The actions there are.
    learning_rate, discount : float
        Of eq. 6.
    epsilon : float
        Share of random actions.
    n_planning : int
        Backups after every step of the methods that plan.
    blocked_reward : float
        What a blocked step earns.
    kappa : float
        Of Dyna-Q+: a step not tried for tau steps is planned with ``kappa * sqrt(tau)`` more.

    """

    kind: int
    n_cols: int
    goal: int
    mask: int
    learning_rate: float
    discount: float
    epsilon: float
    n_planning: int
    blocked_reward: float
    kappa: float


class Tables(NamedTuple):
    """
    What has been learnt; changed in place.

    Parameters
    ----------
    q : ndarray of float64, shape (n_places, 8)
    model : ndarray of int64, shape (n_places, 8)
        Where each action led, -1 before it was tried.
    order : ndarray of int64, shape (8 * n_places,)
        ``place * 8 + action`` of what is planned with: in the order in which they were first
        tried; of Dyna-Q+ all actions of a place from its first visit on.
    n_seen : ndarray of int64, shape (1,)
        How many those are.
    tried : ndarray of int64, shape (n_places, 8)
        At which step each action was tried last; of those that were not, 0.
    clock : ndarray of int64, shape (1,)
        Steps so far.

    """

    q: Values
    model: Places
    order: Places
    n_seen: Places
    tried: Places
    clock: Places


def new_tables(n_places: int) -> Tables:
    """Return the tables of somebody who has learnt nothing."""
    return Tables(np.zeros((n_places, 8)), np.full((n_places, 8), -1, dtype=np.int64),
                  np.zeros(n_places * 8, dtype=np.int64), np.zeros(1, dtype=np.int64),
                  np.zeros((n_places, 8), dtype=np.int64), np.zeros(1, dtype=np.int64))


class Step(NamedTuple):
    """A place, an action, the place it led to, and the action to be taken there."""

    place: int
    action: int
    then: int
    then_action: int


def _compiled(kernel: _Kernel) -> _Kernel:
    return cast(_Kernel, numba.njit(cache=True)(kernel))


@_compiled
def greedy(row: Values, mask: int, rng: np.random.Generator) -> int:
    """Return the allowed action of greatest value, a random one among equals; -1 for none."""
    best, n, value = -1, 0, -np.inf
    for action in range(8):
        if not mask >> action & 1:
            continue
        if row[action] > value:
            best, n, value = action, 1, row[action]
        elif row[action] == value:
            n += 1
            if rng.random() * n < 1.0:
                best = action
    return best


@_compiled
def _choose(row: Values, mask: int, epsilon: float, rng: np.random.Generator) -> int:
    if rng.random() < epsilon:
        return greedy(np.zeros(8), mask, rng)
    return greedy(row, mask, rng)


@_compiled
def _most(row: Values, mask: int) -> float:
    value = -np.inf
    for action in range(8):
        if mask >> action & 1 and row[action] > value:
            value = row[action]
    return value


@_compiled
def _target(place: int, then: int, tables: Tables, settings: Settings) -> float:
    """Return what a step is worth: the best value ahead, discounted, or the goal's reward."""
    if then == settings.goal:
        return 1.0 if then != place else settings.blocked_reward
    reward = settings.blocked_reward if then == place else 0.0
    return reward + settings.discount * _most(tables.q[then], settings.mask)


@_compiled
def _back_up(pair: int, tables: Tables, settings: Settings) -> None:
    """
    Back up a step that the model remembers.

    Of Dyna-Q+ (Sutton and Barto 2018, section 8.3): with a bonus for what was not tried for long;
    what was never tried is taken to lead back to where it began, without a reward.
    """
    place, action = pair // 8, pair % 8
    if tables.model[place, action] >= 0:
        target = _target(place, tables.model[place, action], tables, settings)
    else:
        target = settings.discount * _most(tables.q[place], settings.mask)
    if settings.kind == DYNA_Q_PLUS:
        target += settings.kappa * np.sqrt(float(tables.clock[0] - tables.tried[place, action]))
    tables.q[place, action] += settings.learning_rate * (target - tables.q[place, action])


@_compiled
def plan(tables: Tables, settings: Settings, rng: np.random.Generator) -> None:
    """Dyna-Q and Dyna-Q+: back up steps remembered at random."""
    for _ in range(settings.n_planning):
        _back_up(tables.order[int(rng.random() * tables.n_seen[0])], tables, settings)


@_compiled
def sweep(tables: Tables, queue: Queue, settings: Settings) -> None:
    """Sweep backups in order of how much they change (Moore and Atkeson 1993)."""
    for _ in range(settings.n_planning):
        if len(queue) == 0:
            return
        _, pair = heapq.heappop(queue)
        _back_up(pair, tables, settings)
        place = pair // 8
        for before in range(8):
            origin = place - STEP_ROW[before] * settings.n_cols - STEP_COL[before]
            if 0 <= origin < tables.q.shape[0] and tables.model[origin, before] == place:
                push(tables, queue, origin, before, settings)


@_compiled
def push(tables: Tables, queue: Queue, place: int, action: int, settings: Settings) -> None:
    """Queue a step if backing it up would change its value."""
    target = _target(place, tables.model[place, action], tables, settings)
    change = abs(target - tables.q[place, action])
    if change > _THRESHOLD:
        heapq.heappush(queue, (-change, place * 8 + action))


@_compiled
def note(tables: Tables, step: Step, settings: Settings) -> None:
    """Write a step into the model."""
    model = tables.model[step.place]
    if settings.kind == DYNA_Q_PLUS and (model < 0).all():
        for action in range(8):
            if settings.mask >> action & 1:
                tables.order[tables.n_seen[0]] = step.place * 8 + action
                tables.n_seen[0] += 1
    elif settings.kind != DYNA_Q_PLUS and model[step.action] < 0:
        tables.order[tables.n_seen[0]] = step.place * 8 + step.action
        tables.n_seen[0] += 1
    model[step.action] = step.then
    tables.tried[step.place, step.action] = tables.clock[0]


@_compiled
def learn_step(
    tables: Tables, queue: Queue, step: Step, settings: Settings, rng: np.random.Generator,
) -> None:
    """Learn one step."""
    place, action, then, then_action = step
    note(tables, step, settings)
    if settings.kind == SWEEPING:
        push(tables, queue, place, action, settings)
        sweep(tables, queue, settings)
        return
    target = _target(place, then, tables, settings)
    if settings.kind == SARSA and then != settings.goal:
        reward = settings.blocked_reward if then == place else 0.0
        target = reward + settings.discount * tables.q[then, then_action]
    tables.q[place, action] += settings.learning_rate * (target - tables.q[place, action])
    if settings.kind in (DYNA_Q, DYNA_Q_PLUS):
        plan(tables, settings, rng)


@_compiled
def replay(
    tables: Tables, places: Places, actions: Places, n: int, settings: Settings,
    rng: np.random.Generator,
) -> None:
    """
    Learn a path ``n`` times, last step first.

    Parameters
    ----------
    places : ndarray of int64, shape (k + 1,)
    actions : ndarray of int64, shape (k,)

    """
    queue = [(0.0, 0)]
    queue.pop()
    for _ in range(n):
        for i in range(len(actions) - 1, -1, -1):
            then_action = actions[min(i + 1, len(actions) - 1)]
            step = Step(places[i], actions[i], places[i + 1], then_action)
            learn_step(tables, queue, step, settings, rng)


@_compiled
def run_episode(
    allowed: Places, tables: Tables, start: int, step_limit: int, settings: Settings,
    rng: np.random.Generator,
) -> tuple[int, int, int]:
    """
    Run an episode, epsilon-greedy, and learn at every step.

    A blocked step earns what the settings say and leaves the robot where it is, the goal earns +1.

    Parameters
    ----------
    allowed : ndarray of int64, shape (n_places,)
        Mask of the steps that the true world allows.

    Returns
    -------
    n_steps, n_bumps, n_rewards : int

    """
    queue = [(0.0, 0)]
    queue.pop()
    n_bumps, n_rewards, place, mask = 0, 0, start, settings.mask
    action = _choose(tables.q[place], mask, settings.epsilon, rng)
    for step in range(step_limit):
        if place == settings.goal:
            return step, n_bumps, n_rewards
        then = place
        tables.clock[0] += 1
        if allowed[place] >> action & 1:
            then = place + STEP_ROW[action] * settings.n_cols + STEP_COL[action]
        else:
            n_bumps += 1
        n_rewards += int(then in (place, settings.goal))
        then_action = _choose(tables.q[then], mask, settings.epsilon, rng)
        learn_step(tables, queue, Step(place, action, then, then_action), settings, rng)
        place = then
        # Off-policy methods choose anew with what they have just learnt.
        action = then_action if settings.kind == SARSA else _choose(
            tables.q[place], mask, settings.epsilon, rng)
    return step_limit, n_bumps, n_rewards


@_compiled
def run_steps(
    allowed: Places, tables: Tables, start: int, settings: Settings, rng: np.random.Generator,
    n_steps: int, place: int,
) -> tuple[int, Places]:
    """
    Learn for so many steps, one episode after another, epsilon-greedy; for off-policy methods.

    Parameters
    ----------
    allowed : ndarray of int64, shape (n_places,)
        Mask of the steps that the true world allows.
    start : int
        Where every episode begins.
    n_steps : int
    place : int
        Where the robot is.

    Returns
    -------
    place : int
        Where it is afterwards.
    n_arrived : ndarray of int64, shape (n_steps,)
        How often it has reached the goal by each step.

    """
    queue = [(0.0, 0)]
    queue.pop()
    n_arrived = np.zeros(n_steps, dtype=np.int64)
    n = 0
    for step in range(n_steps):
        action = _choose(tables.q[place], settings.mask, settings.epsilon, rng)
        then = place
        tables.clock[0] += 1
        if allowed[place] >> action & 1:
            then = place + STEP_ROW[action] * settings.n_cols + STEP_COL[action]
        learn_step(tables, queue, Step(place, action, then, action), settings, rng)
        if then == settings.goal:
            n += 1
            then = start
        place = then
        n_arrived[step] = n
    return place, n_arrived


@_compiled
def greedy_run(
    allowed: Places, q: Values, start: int, step_limit: int, settings: Settings,
    rng: np.random.Generator,
) -> tuple[int, int, float]:
    """
    Follow the greedy policy without the steps seen to be blocked; learn nothing.

    Returns
    -------
    outcome : int
        0 goal, 2 gave up.
    n_steps : int
    length : float, [cells]

    """
    length, place = 0.0, start
    for step in range(step_limit):
        if place == settings.goal:
            return 0, step, length
        action = greedy(q[place], allowed[place], rng)
        if action < 0:
            return 2, step, length
        length += np.sqrt(float(STEP_ROW[action] ** 2 + STEP_COL[action] ** 2))
        place += STEP_ROW[action] * settings.n_cols + STEP_COL[action]
    return 0 if place == settings.goal else 2, step_limit, length
