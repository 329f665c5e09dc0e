"""Teaching on running nodes: the way is shown once, then the robot tries."""

from collections.abc import Mapping
from typing import Any, Final

from control_field.grid import Grid
from experience_cli.demo.path_follower import Driver, points_from_cells
from experience_cli.terminal import Progress
from learner_node.reports import NEXT

#: The way that is shown, as cells (row, col): through where the obstacles later stand.
WAY: Final = ((3, 2), (3, 15), (16, 15))


def teach(node: Any, progress: Progress) -> None:
    """Drive the demonstration, and keep it."""
    node.ask('learner_node/record_demonstration', True)
    node.drive(Driver(points_from_cells(Grid(20, 20, 0.25), WAY)),
               lambda share: progress.show(f'demonstration: {share:.0%} of the way'))
    # Here nobody has to press a key.
    said = node.ask('learner_node/record_demonstration', False)
    progress.keep(said.removesuffix(NEXT).rstrip())


def try_it(
    node: Any, world: str, n_trials: int, progress: Progress, movers: str = '',
) -> None:
    """Let the world of the task appear, and who moves in it, and the trials run."""
    revision = int(node.learner['revision'])
    node.set_parameter('sim_node', 'world', world)
    if movers:
        node.set_parameter('sim_node', 'movers', movers)
    node.ask('learner_node/run_trials')
    _watch(node, n_trials, max(revision, 1) + n_trials, progress)


def _watch(node: Any, n_trials: int, revision: int, progress: Progress) -> None:
    """Show the trials until the learner has learnt from the last one, to a revision."""
    ended = 0  # the last trial whose end was shown

    def is_done() -> bool:
        nonlocal ended
        status, learner = node.status, node.learner
        if status is not None and status.trial:
            if status.outcome is None or status.trial == ended:
                progress.show(f'trial {status.trial} of {n_trials}: step {status.steps}')
            else:
                ended = status.trial
                progress.keep(_ending(status, learner))
        return (int(learner.get('revision', 0)) >= revision and learner.get('phase') == 'idle'
                and learner.get('trials_left') == '0')

    node.wait_until(is_done, 'the end of the trials', patience=60.0 * n_trials + 60.0)


def _ending(status: Any, learner: Mapping[str, str]) -> str:
    """Say how a trial ended, and in which bag it is, as far as that is known."""
    bag = learner.get('bag', '') if learner.get('trial') == str(status.trial) else ''
    name = f'trial {status.trial}'
    return status.sentence.replace(name, f'{name} ({bag})', 1) if bag else str(status.sentence)
