"""`experience demo --page`: the demo, seen in a browser, which stays when it is over."""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
import sys
from typing import Final

from experience_cli.demo.client_node import DemoNode
from experience_cli.demo.page_door import (
    be_stopped, free_port, PAGE, show, wait_for_address, watch)
from experience_cli.demo.processes import Children
from experience_cli.demo.show_and_try import teach, try_it
from experience_cli.interrupts import Stopped
from experience_cli.terminal import Progress

_HOST: Final = '127.0.0.1'
#: How many times as fast as a real robot, so that a class can watch it learn.
_SPEED: Final = 4.0
#: Parameters of such a simulator: as many messages a second as in real time would be 40.
FAST: Final = {'speed_factor': _SPEED, 'rate': 10.0}
#: Those of its controller, [s] of simulated time: where a machine is slow, it is so in its own.
#: What brakes a robot whose odometry comes late stays as it is.
FAST_RULES: Final = {
    'progress_time': 10.0 * _SPEED, 'stall_time': 2.0 * _SPEED, 'odom_timeout': 0.5 * _SPEED,
    'neighbourhood_timeout': 0.5 * _SPEED, 'takeover_timeout': 0.5 * _SPEED}


def show_live(
    task: str, world: str, arguments: argparse.Namespace, out: Path,
    environment: Mapping[str, str], parameters: Mapping[str, Mapping[str, object]],
    report: Callable[[], int],
) -> int:
    """
    Start the nodes and the page, begin when somebody looks, and stay until Ctrl-C.

    Parameters
    ----------
    task, world : str
    arguments : Namespace
    out : Path
        Where logs and bags are.
    environment : mapping
        Of the nodes.
    parameters : mapping
        Of each node but the page.
    report : callable
        Called once the trials are over; what it returns is returned.

    Raises
    ------
    UserError
        If a node ends, or does not do what it is asked for.
    Stopped
        If somebody ends it before the trials are over.

    """
    domain = environment.get('ROS_DOMAIN_ID')
    progress = Progress(task, sys.stdout)
    page = {'host': _HOST, 'port': free_port(_HOST), 'simulation': True,
            'enable_stamped_cmd_vel': True, 'bags': parameters['learner_node']['bags']}
    logs = out / 'logs' / task
    with Children(logs, environment) as children:
        for name, values in {**parameters, PAGE: page}.items():
            children.start_node(name, values)
        show(wait_for_address(children), logs / 'browser.log', not arguments.no_browser)
        with DemoNode(int(domain) if domain else None, children.check) as node, progress:
            node.wait_for_peers()
            progress.keep('begins when somebody looks at the page; its room Story shows how the '
                          'robot learns')
            node.wait_for_viewers()
            teach(node, progress)
            try_it(node, world, arguments.trials, progress, arguments.movers)
        code = report()
        print('\nthe page stays, and the robot can be taught there, until Ctrl-C', flush=True)
        try:
            watch(children)
        except Stopped:
            be_stopped()
            return code
