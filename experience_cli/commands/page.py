"""`experience page`: a page to teach from, with everything that it needs."""

import argparse
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
import shutil
from typing import Any, Final

from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import check_task_name
from experience_cli.demo.page_door import (
    be_stopped, free_port, PAGE, show, wait_for_address, watch)
from experience_cli.demo.processes import Children, own_domain
from experience_cli.demo.task_settings import settings_for
from experience_cli.errors import UserError
from experience_cli.interrupts import Stopped
from experience_cli.robot.parameter_sources import node_parameters
from world_maps.world import config_file, find_world, load_world

#: Where the simulated robot is, and what it learns, if nobody says.
_WORLD: Final = 'task1'
_TASK: Final = 'task'
#: What a robot needs, and what all who send it commands have to know.
_ROBOT: Final = ('neighbourhood_node', 'control_field_node', 'learner_node', PAGE)
_WIRE: Final = ('enable_stamped_cmd_vel',)
#: ROS parameters of each node by its name.
Nodes = dict[str, dict[str, Any]]


def run(arguments: argparse.Namespace) -> int:
    """Start the nodes and show the page; return 0 when somebody ends it."""
    nodes = robot_nodes(arguments) if arguments.robot else simulated_nodes(arguments)
    nodes[PAGE] |= _place(arguments)
    logs = _logs(arguments.out / 'logs')
    try:
        with _domain(arguments) as environment, Children(logs, environment) as children:
            for name, parameters in nodes.items():
                children.start_node(name, parameters)
            show(wait_for_address(children), logs / 'browser.log', not arguments.no_browser)
            if arguments.foxglove_port:
                print(f'In Foxglove: ws://127.0.0.1:{arguments.foxglove_port}', flush=True)
            watch(children)
    except Stopped:
        be_stopped()
        return 0


def simulated_nodes(arguments: argparse.Namespace) -> Nodes:
    """Return what a simulated robot needs."""
    name = arguments.world or _WORLD
    try:
        path = find_world(name)
        load_world(path)
    except ValueError as error:
        raise UserError(f'--world {name}: {error}') from None
    memory = {'simulation': True, 'bags': _bags(arguments)}
    world = name if path.stem == name else str(path.resolve())
    learning = settings_for(name, '')
    return {
        'sim_node': {'world': world}, 'control_field_node': {**learning},
        'learner_node': {**learning, **memory, 'task': _task(arguments, path.stem)}, PAGE: memory}


def robot_nodes(arguments: argparse.Namespace) -> Nodes:
    """Return what a robot needs that has been brought up."""
    if arguments.world:
        raise UserError(f'--world {arguments.world}: is for a simulated robot, not with --robot')
    try:
        path = config_file(arguments.robot, 'robots', ('.yaml', '.yml'))
    except ValueError as error:
        raise UserError(f'--robot {arguments.robot}: {error}') from None
    sections = node_parameters(path)
    if missing := [name for name in _ROBOT if name not in sections]:
        raise UserError(f'--robot {path}: says nothing of {missing[0]}; `experience robot` writes '
                        f'such a file')
    wire = {name: sections[PAGE][name] for name in _WIRE if name in sections[PAGE]}
    memory = {'simulation': False, 'bags': _bags(arguments)}
    own = {
        'neighbourhood_node': {}, 'control_field_node': wire,
        'learner_node': {**wire, **memory, 'task': _task(arguments, _TASK)}, PAGE: memory}
    return {name: {**sections[name], **parameters} for name, parameters in own.items()}


def _bags(arguments: argparse.Namespace) -> str:
    """Return where the learner, and the page that shows it, have their bags."""
    return str(arguments.bags.resolve())


def _task(arguments: argparse.Namespace, usual: str) -> str:
    """Return the name of the task."""
    task = str(arguments.task or usual)
    try:
        return check_task_name(task)
    except BagError as error:
        raise UserError(f'--task {task}: its {error}') from None


def _place(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return where the page is: where it was asked for, or at a free port."""
    port = free_port(arguments.host) if arguments.port is None else arguments.port
    return {'host': arguments.host, 'port': port, 'foxglove_port': arguments.foxglove_port}


def _domain(
    arguments: argparse.Namespace,
) -> AbstractContextManager[Mapping[str, str]]:
    """Return the environment: a simulated robot is alone, a real one is where it was set."""
    return nullcontext({}) if arguments.robot else own_domain()


def _logs(folder: Path) -> Path:
    """Return the folder, with nothing of the last time in it."""
    try:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f'cannot write into {folder}: {error.strerror}') from None
    return folder
