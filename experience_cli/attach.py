"""`experience demo --attach`: teach and try on nodes that run already, such as a launch file's."""

import argparse
import os
import sys

from experience_cli.errors import UserError
from experience_cli.progress import Progress


def attach(task: str, arguments: argparse.Namespace) -> int:
    """
    Show the way and let the robot try, in this ROS domain and a namespace; then leave.

    A learner that was taught before, as its bags say, is not taught again.

    Raises
    ------
    UserError
        If the nodes are not there, or do not do what is asked.

    """
    from experience_cli.demo import teach, try_it
    from experience_cli.node import DemoNode

    progress = Progress(task, sys.stdout)
    progress.show('waiting for simulator, controller and learner')
    with DemoNode(_domain(), lambda: None, arguments.namespace) as node, progress:
        node.wait_for_peers()
        node.set_parameter('learner_node', 'auto_trials', arguments.trials)
        if int(node.learner['revision']) > 0:
            progress.keep(f'the learner knows the way ({node.learner["revision"]} bags)')
        else:
            node.set_parameter('sim_node', 'world', 'open')
            teach(node, progress)
        try_it(node, task, arguments.trials, progress)
        progress.keep(f'the trials are over: {node.learner["prototypes"]} prototypes, '
                      f'basin {float(node.learner["basin"]):.1%}')
    return 0


def _domain() -> int | None:
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain and not domain.isdigit():
        raise UserError(f'ROS_DOMAIN_ID is {domain!r}, must be a number')
    return int(domain) if domain else None
