"""What a method is worth, from every free cell of the true world."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from control_field.kernels import compiled
from control_field.learning.certificate import fidelity_of
from control_field.learning.judge import Runs
from experience_evaluation.environment import Environment
from experience_evaluation.methods.method import FieldMethod, Method, Task

#: The metrics in the order of tables: name -> meaning.
METRICS = {
    'field_success': 'share of the starts from which the flow alone, without local grid, reaches '
                     'the goal',
    'success': 'share of the starts from which a trial with local grid and exploration reaches '
               'the goal, learning off',
    'field_success_spl': 'SPL of field_success: mean of success * shortest / max(length, '
                         'shortest); the goal cell counts 1',
    'success_spl': 'SPL of success',
    'steps': 'steps driven in the trials so far',
    'collisions': 'collisions in the trials so far and in all runs of `success`',
    'mover_contacts': 'how often something that moves ran into the robot, in the trials so far '
                      'and in all runs of `success`',
    'reinforcements': 'rewards other than zero in the last trial, online and offline',
    'hidden_neurons': 'prototypes',
    'hidden_neurons_share': 'prototypes for each free reachable cell',
    'fidelity': 'share of the demonstrated cells, among those not proven blocked, where the field '
                'still does what was shown',
    'fidelity_in_truth': 'the same among those whose demonstrated step the true world allows, '
                         'whatever is remembered',
    'basin': 'share of the known free, reachable cells whose flow reaches the goal on the '
             'remembered map',
    'flow_steps': "steps along the flow from the first demonstration's start to the goal; not "
                  'defined where it does not get there',
    'greedy_steps': 'the same, taking the first of the greatest Q-values at every cell',
    'seconds_learning': 'seconds spent learning from the last trial (or demonstrations), on this '
                        'machine',
}


def spl(home: npt.NDArray[np.bool_], length: npt.NDArray[np.float64],
        shortest: npt.NDArray[np.float64]) -> float:
    """
    Return success weighted by path length (Anderson et al. 2018).

    Parameters
    ----------
    home : ndarray of bool, shape (n,)
        Whether each run reached the goal.
    length : ndarray, shape (n,), [cells]
        Of each run; not looked at where it failed.
    shortest : ndarray, shape (n,), [cells]
        0 at the goal itself, which counts 1.

    """
    longest = np.where(home, np.maximum(length, shortest), 1.0)
    share = np.where(longest > 0.0, shortest / np.where(longest > 0.0, longest, 1.0), 1.0)
    return share_of(np.where(home, share, 0.0))


def share_of(values: npt.NDArray[np.bool_] | npt.NDArray[np.float64]) -> float:
    """Return the mean; NaN of nothing."""
    return float(values.mean()) if len(values) else float('nan')


def judge(method: Method, task: Task, environment: Environment, judged: npt.NDArray[np.bool_],
          demonstrated: npt.NDArray[np.int8],
          watch: Callable[[int], None] | None = None) -> dict[str, float]:
    """
    Judge a method as it stands.

    Parameters
    ----------
    method : Method
    task : Task
    environment : Environment
        What is true now.
    judged : ndarray of bool, shape (n_rows, n_cols)
        The starts.
    demonstrated : ndarray of int8, shape (n_rows, n_cols)
        Demonstrated headings, -1 for none.
    watch : callable, optional
        Is told how many starts are judged, again and again.

    Returns
    -------
    dict
        Metrics by name; those of the practice so far are left at 0.

    """
    headings = method.headings()
    lengths = flow_lengths(environment, headings)[judged]
    shortest = environment.shortest[judged]
    n_contacts = environment.n_mover_contacts
    runs = method.runs(environment, np.argwhere(judged), 0, watch)
    truly = fidelity_of(headings, demonstrated, environment.world.truth, environment.world.rules)
    notes, n_reachable = method.notes(), int(environment.reachable.sum())
    home, arrived = np.isfinite(lengths), runs.outcome == 0
    return {
        'field_success': share_of(home), 'success': share_of(arrived),
        'field_success_spl': spl(home, lengths, shortest),
        'success_spl': spl(arrived, runs.length, shortest),
        'steps': 0.0, 'collisions': _n_collisions(runs),
        'mover_contacts': float(environment.n_mover_contacts - n_contacts), 'reinforcements': 0.0,
        'hidden_neurons': float(notes.n_prototypes),
        'hidden_neurons_share': (
            notes.n_prototypes / n_reachable if n_reachable else float('nan')),
        'fidelity': notes.fidelity if np.isfinite(notes.fidelity) else truly,
        'fidelity_in_truth': truly, 'basin': notes.basin,
        'flow_steps': _n_steps(task, environment, headings),
        'greedy_steps': _n_steps(task, environment, greedy_headings(method)),
        'seconds_learning': 0.0}


def flow_lengths(
    environment: Environment, headings: npt.NDArray[np.int8],
) -> npt.NDArray[np.float64]:
    """Return the length of the flow home from every cell of the truth; inf where it fails."""
    lengths: npt.NDArray[np.float64] = compiled.flow_lengths(
        environment.world.truth, headings, *environment.goal, environment.world.rules)
    return lengths


def greedy_headings(method: Method) -> npt.NDArray[np.int8]:
    """Return the heading of greatest Q-value a cell; of tables of values that is their heading."""
    if isinstance(method, FieldMethod):
        return np.asarray(method.refresh.field.q.argmax(axis=2), dtype=np.int8)
    return method.headings()


def _n_steps(task: Task, environment: Environment, headings: npt.NDArray[np.int8]) -> float:
    """Return the steps from the demonstration's start to the goal of the truth; else NaN."""
    world = environment.world
    if world.truth[task.first_start] != 0:
        return float('nan')
    n = int(compiled.flow_reaches(
        world.truth, headings, *task.first_start, *task.goal, world.rules))
    return float(n) if n >= 0 else float('nan')


def _n_collisions(runs: Runs) -> float:
    return float((runs.outcome == 1).sum())
