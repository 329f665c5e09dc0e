"""`experience demo --attach`: teach and try on nodes that run already, such as a launch file's."""

import argparse
import os
import sys
import time
from typing import Final

from control_field.words import counted
from experience_cli.demo.client_node import DemoNode
from experience_cli.demo.show_and_try import teach, try_it
from experience_cli.errors import UserError
from experience_cli.terminal import Progress

#: What takes less is not worth a line, [s].
_AT_ONCE: Final = 1.5
#: A node that has not appeared after this time was not started, [s].
_PATIENCE: Final = 60.0


def attach(task: str, world: str, arguments: argparse.Namespace) -> int:
    """
    Show the way and let the robot try, in this ROS domain and a namespace; then leave.

    A learner that was taught before, as its bags say, is not taught again.

    Raises
    ------
    UserError
        If the nodes are not there, or do not do what is asked.

    """
    progress = Progress(task, sys.stdout)
    with DemoNode(_domain(), lambda: None, arguments.namespace) as node, progress:
        node.wait_for_peers(_Waiting(progress), _PATIENCE)
        node.set_parameter('learner_node', 'auto_trials', arguments.trials)
        if int(node.learner['revision']) > 0:
            bags = counted(int(node.learner['revision']), 'bag')
            progress.keep(f'the learner knows the way ({bags})')
        else:
            node.set_parameter('sim_node', 'world', 'open')
            teach(node, progress)
        try_it(node, world, arguments.trials, progress, arguments.movers)
        progress.keep(f'the trials are over: {node.learner["prototypes"]} prototypes, '
                      f'basin {float(node.learner["basin"]):.1%}')
    return 0


class _Waiting:
    """
    Shows what is waited for; where no line can change, only what takes a while.

    Parameters
    ----------
    progress : Progress

    """

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._began = time.monotonic()
        self._last_kept = ''

    def __call__(self, what: str) -> None:
        """Say what is waited for."""
        self._progress.show(f'waiting for {what}')
        if (not self._progress.is_live and what != self._last_kept
                and time.monotonic() - self._began > _AT_ONCE):
            self._last_kept = what
            self._progress.keep(f'waiting for {what}')


def _domain() -> int | None:
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain and not domain.isdigit():
        raise UserError(f'ROS_DOMAIN_ID is {domain!r}, must be a number')
    return int(domain) if domain else None
