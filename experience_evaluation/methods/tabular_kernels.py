"""The loops of tabular reinforcement learning, compiled."""

from collections.abc import Callable
import heapq
from typing import Any, cast, TypeVar

import numba
import numpy as np
import numpy.typing as npt

from control_field.headings import STEP_COL, STEP_ROW

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.int64]
Queue = list[tuple[float, int]]
#: ``(alpha, discount, epsilon, n_planning)``
Numbers = tuple[float, float, float, int]
#: Least change that prioritised sweeping follows up.
_THRESHOLD = 1e-4
Q_LEARNING, SARSA, DYNA_Q, SWEEPING = 0, 1, 2, 3
_Kernel = TypeVar('_Kernel', bound=Callable[..., Any])


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
def _target(
    q: Values, reward: float, then: int, is_end: bool, discount: float, mask: int,
) -> float:
    return reward if is_end else reward + discount * _most(q[then], mask)


@_compiled
def plan(
    q: Values, model: Places, order: Places, n_seen: int, goal: int, alpha: float, discount: float,
    n_planning: int, mask: int, rng: np.random.Generator,
) -> None:
    """Dyna-Q: back up steps remembered at random."""
    for _ in range(n_planning):
        pair = order[int(rng.random() * n_seen)]
        place, action = pair // 8, pair % 8
        then = model[place, action]
        reward = -1.0 if then == place else (1.0 if then == goal else 0.0)
        q[place, action] += alpha * (
            _target(q, reward, then, then == goal, discount, mask) - q[place, action])


@_compiled
def sweep(
    q: Values, model: Places, queue: Queue, n_cols: int, goal: int, alpha: float, discount: float,
    n_planning: int, mask: int,
) -> None:
    """Sweep backups in order of how much they change (Moore and Atkeson 1993)."""
    for _ in range(n_planning):
        if len(queue) == 0:
            return
        _, pair = heapq.heappop(queue)
        place, action = pair // 8, pair % 8
        then = model[place, action]
        reward = -1.0 if then == place else (1.0 if then == goal else 0.0)
        q[place, action] += alpha * (
            _target(q, reward, then, then == goal, discount, mask) - q[place, action])
        for before in range(8):
            origin = place - STEP_ROW[before] * n_cols - STEP_COL[before]
            if 0 <= origin < q.shape[0] and model[origin, before] == place:
                push(q, model, queue, origin, before, goal, discount, mask)


@_compiled
def push(
    q: Values, model: Places, queue: Queue, place: int, action: int, goal: int, discount: float,
    mask: int,
) -> None:
    """Queue a step if backing it up would change its value."""
    then = model[place, action]
    reward = -1.0 if then == place else (1.0 if then == goal else 0.0)
    change = abs(_target(q, reward, then, then == goal, discount, mask) - q[place, action])
    if change > _THRESHOLD:
        heapq.heappush(queue, (-change, place * 8 + action))


@_compiled
def note(model: Places, order: Places, n_seen: int, place: int, action: int, then: int) -> int:
    """Write a step into the model; return the number of different steps in it."""
    if model[place, action] < 0:
        order[n_seen] = place * 8 + action
        n_seen += 1
    model[place, action] = then
    return n_seen


@_compiled
def learn_step(
    kind: int, q: Values, model: Places, order: Places, n_seen: int, queue: Queue, n_cols: int,
    place: int, action: int, then: int, then_action: int, goal: int, numbers: Numbers, mask: int,
    rng: np.random.Generator,
) -> int:
    """Learn one step; ``numbers`` is ``(alpha, discount, epsilon, n_planning)``."""
    alpha, discount, _, n_planning = numbers
    reward = -1.0 if then == place else (1.0 if then == goal else 0.0)
    n_seen = note(model, order, n_seen, place, action, then)
    if kind == SWEEPING:
        push(q, model, queue, place, action, goal, discount, mask)
        sweep(q, model, queue, n_cols, goal, alpha, discount, n_planning, mask)
        return n_seen
    target = _target(q, reward, then, then == goal, discount, mask)
    if kind == SARSA and then != goal:
        target = reward + discount * q[then, then_action]
    q[place, action] += alpha * (target - q[place, action])
    if kind == DYNA_Q:
        plan(q, model, order, n_seen, goal, alpha, discount, n_planning, mask, rng)
    return n_seen


@_compiled
def replay(
    kind: int, q: Values, model: Places, order: Places, n_seen: int, n_cols: int, places: Places,
    actions: Places, goal: int, numbers: Numbers, mask: int, n: int, rng: np.random.Generator,
) -> int:
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
            n_seen = learn_step(kind, q, model, order, n_seen, queue, n_cols, places[i],
                                actions[i], places[i + 1], then_action, goal, numbers, mask, rng)
    return n_seen


@_compiled
def run_episode(
    kind: int, allowed: Places, n_cols: int, q: Values, model: Places, order: Places, n_seen: int,
    place: int, goal: int, numbers: Numbers, mask: int, step_limit: int, rng: np.random.Generator,
) -> tuple[int, int, int, int]:
    """
    Run an episode, epsilon-greedy, and learn at every step.

    A blocked step earns -1 and leaves the robot where it is, the goal earns +1.

    Parameters
    ----------
    allowed : ndarray of int64, shape (n_places,)
        Mask of the steps that the true world allows.
    mask : int
        The actions there are.

    Returns
    -------
    n_steps, n_bumps, n_rewards, n_seen : int

    """
    queue = [(0.0, 0)]
    queue.pop()
    n_bumps, n_rewards = 0, 0
    action = _choose(q[place], mask, numbers[2], rng)
    for step in range(step_limit):
        if place == goal:
            return step, n_bumps, n_rewards, n_seen
        then = place
        if allowed[place] >> action & 1:
            then = place + STEP_ROW[action] * n_cols + STEP_COL[action]
        else:
            n_bumps += 1
        n_rewards += int(then in (place, goal))
        then_action = _choose(q[then], mask, numbers[2], rng)
        n_seen = learn_step(kind, q, model, order, n_seen, queue, n_cols, place, action, then,
                            then_action, goal, numbers, mask, rng)
        place = then
        # Off-policy methods choose anew with what they have just learnt.
        action = then_action if kind == SARSA else _choose(q[place], mask, numbers[2], rng)
    return step_limit, n_bumps, n_rewards, n_seen


@_compiled
def greedy_run(
    allowed: Places, n_cols: int, q: Values, place: int, goal: int, step_limit: int,
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
    length = 0.0
    for step in range(step_limit):
        if place == goal:
            return 0, step, length
        action = greedy(q[place], allowed[place], rng)
        if action < 0:
            return 2, step, length
        length += np.sqrt(float(STEP_ROW[action] ** 2 + STEP_COL[action] ** 2))
        place += STEP_ROW[action] * n_cols + STEP_COL[action]
    return 0 if place == goal else 2, step_limit, length
