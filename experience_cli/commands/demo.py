"""`experience demo`: the paper's two tasks, taught and tried on the real nodes."""

import argparse
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
import shutil
import sys
import time
from typing import Any, Final

from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import check_task_name, TaskFolder
from experience_cli.arguments import DEMO_DEFAULTS
from experience_cli.bag_summary import grid_text
from experience_cli.demo.attach import attach
from experience_cli.demo.client_node import DemoNode
from experience_cli.demo.live import FAST, FAST_RULES, show_live
from experience_cli.demo.processes import Children, own_domain
from experience_cli.demo.report import report_from_bags, report_lines, write_report
from experience_cli.demo.show_and_try import teach, try_it
from experience_cli.demo.task_settings import settings_for
from experience_cli.errors import UserError
from experience_cli.figures.paper_figures import draw_figures
from experience_cli.terminal import Progress
from world_maps.mover import Mover
from world_maps.movers_file import find_movers, load_movers
from world_maps.world import find_world, load_world, World

#: A file that marks the folder as a demo's, which may be overwritten.
_MARK: Final = '.experience_demo'
#: Where the bags of the previous demo are.
_BEFORE: Final = 'before'
#: Ticks a second of the simulator.
_RATE: Final = 20.0
#: The learner's workspace is that of the world: the paper's.
_WORKSPACE: Final = {'rows': 20, 'cols': 20, 'resolution': 0.25}


def run(arguments: argparse.Namespace) -> int:
    """Run the demo; return 0 if the paper's result was shown."""
    began = time.monotonic()
    _fill_in(arguments)
    tasks = _checked_tasks(arguments)
    worlds = _load_worlds(tasks)
    movers = _load_movers(arguments, worlds)
    for note in (note for world in worlds.values() for note in world.notes):
        print(f'experience demo: {note}', file=sys.stderr)
    if arguments.attach:
        [(task, world)] = tasks.items()
        return attach(task, world, arguments)
    _check_grids(tasks, worlds)
    settings = {task: settings_for(world, arguments.settings) for task, world in tasks.items()}
    out = _prepare(arguments.out, tasks)

    def report() -> int:
        return _report(settings, worlds, movers, arguments, out, began)

    with own_domain() as environment:
        for task, world in tasks.items():
            parameters = node_parameters(task, arguments, out, settings[task])
            if arguments.page:
                return show_live(task, world, arguments, out, environment, parameters, report)
            _teach_and_try(task, world, arguments, out, environment, parameters)
    return report()


def _fill_in(arguments: argparse.Namespace) -> None:
    """Set the defaults; UserError if options do not go together."""
    if arguments.attach and arguments.page:
        raise UserError('--page: is not for --attach, start a page_node where the nodes run')
    if arguments.no_browser and not arguments.page:
        raise UserError('--no-browser: is for --page only')
    for name, value in DEMO_DEFAULTS.items():
        if getattr(arguments, name) is None:
            setattr(arguments, name, value)
        elif arguments.attach:
            raise UserError(f'--{name}: is not for --attach, the nodes that run already have '
                            f'theirs')


def _checked_tasks(arguments: argparse.Namespace) -> dict[str, str]:
    """Return the worlds by the name of their task; UserError if an argument is wrong."""
    usual = '1' if arguments.attach else 'dead_ends' if arguments.page else '1,2'
    listed = arguments.tasks if arguments.tasks is not None else usual
    worlds = [f'task{name}' if name.isdigit() else name for name in listed.split(',') if name]
    tasks = {_task_of(world): world for world in worlds}
    if not tasks:
        raise UserError(f'--tasks {listed!r} names no task, must be like 1,2')
    if len(tasks) < len(worlds):
        raise UserError(f'--tasks {listed}: two of them have one name, and so one folder')
    if not 1 <= arguments.trials <= 10_000:
        raise UserError(f'--trials {arguments.trials}: must be between 1 and 10000')
    if arguments.seed < 0:
        raise UserError(f'--seed {arguments.seed}: must be 0 or more')
    if arguments.attach and len(tasks) > 1:
        raise UserError(f'--tasks {listed}: with --attach one task, the learner that runs has one')
    if arguments.page and len(tasks) > 1:
        raise UserError(f'--tasks {listed}: with --page one task, the page shows one')
    if arguments.namespace and not arguments.attach:
        raise UserError(f'--namespace {arguments.namespace}: is for --attach only')
    return tasks


def _task_of(world: str) -> str:
    """Return the name of a world's task: that of the file, without folder and ending."""
    try:
        return check_task_name(Path(world).stem)
    except BagError as error:
        raise UserError(f'--tasks {world}: its {error}') from None


def _load_worlds(tasks: Mapping[str, str]) -> dict[str, World]:
    try:
        return {task: load_world(find_world(world)) for task, world in tasks.items()}
    except ValueError as error:
        raise UserError(str(error)) from None


def _load_movers(
    arguments: argparse.Namespace, worlds: Mapping[str, World],
) -> tuple[Mover, ...]:
    """Return who moves; what is named is the file then, wherever the simulator runs."""
    if not arguments.movers:
        return ()
    try:
        arguments.movers = str(find_movers(arguments.movers).resolve())
        scripts = [load_movers(arguments.movers, world) for world in worlds.values()]
    except ValueError as error:
        raise UserError(str(error)) from None
    return scripts[0].movers


def _check_grids(tasks: Mapping[str, str], worlds: Mapping[str, World]) -> None:
    """Refuse a world in which the way cannot be demonstrated."""
    shown = _load_worlds({'open': 'open'})['open'].grid
    for task, world in worlds.items():
        if world.grid != shown:
            raise UserError(f'--tasks {tasks[task]}: its world has {grid_text(world.grid)}; the '
                            f'way is shown in {grid_text(shown)}, it must have those')


def _prepare(out: Path, tasks: Collection[str]) -> Path:
    """Make the folder; the bags that an earlier demo left there are set aside."""
    mark = out / _MARK
    try:
        out.mkdir(parents=True, exist_ok=True)
        if not mark.exists() and any((out / 'bags' / task).exists() for task in tasks):
            raise UserError(f'{out / "bags"} holds bags that no demo has made, name another '
                            f'folder with --out')
        mark.touch()
        for task in tasks:
            _set_aside(out, task)
            shutil.rmtree(out / 'logs' / task, ignore_errors=True)
            (out / 'logs' / task).mkdir(parents=True)
    except OSError as error:
        raise UserError(f'cannot write into {out}: {error.strerror}') from None
    return out


def _set_aside(out: Path, task: str) -> None:
    """Keep the bags of the previous demo: somebody may have taught in them."""
    old, aside = out / 'bags' / task, out / _BEFORE / task
    if not old.exists():
        return
    shutil.rmtree(aside, ignore_errors=True)
    aside.parent.mkdir(exist_ok=True)
    old.replace(aside)
    print(f'the bags of {task} from the demo before are in {aside}')


def node_parameters(
    task: str, arguments: argparse.Namespace, out: Path, settings: Mapping[str, Any],
) -> dict[str, dict[str, object]]:
    """Return the parameters of the three nodes, with the settings of their task."""
    common = {'lockstep': not (arguments.realtime or arguments.page),
              'enable_stamped_cmd_vel': True}
    learning = {'profile': arguments.profile, 'seed': arguments.seed, **settings}
    is_fast = arguments.page and not arguments.realtime
    return {
        'sim_node': {**common, 'world': 'open', **(FAST if is_fast else {'rate': _RATE})},
        'control_field_node': {**common, **learning, **(FAST_RULES if is_fast else {})},
        'learner_node': {
            **common, **learning, **_WORKSPACE, 'simulation': True, 'task': task,
            'bags': str((out / 'bags').resolve()), 'auto_trials': arguments.trials}}


def _teach_and_try(
    task: str, world: str, arguments: argparse.Namespace, out: Path,
    environment: Mapping[str, str], parameters: Mapping[str, Mapping[str, object]],
) -> None:
    domain = environment.get('ROS_DOMAIN_ID')
    progress = Progress(task, sys.stdout)
    progress.show('starting simulator, controller and learner')
    with Children(out / 'logs' / task, environment) as children:
        for name, values in parameters.items():
            children.start_node(name, values)
        with DemoNode(int(domain) if domain else None, children.check) as node, progress:
            node.wait_for_peers()
            teach(node, progress)
            try_it(node, world, arguments.trials, progress, arguments.movers)


def _report(
    tasks: Mapping[str, Mapping[str, Any]], worlds: Mapping[str, World],
    movers: tuple[Mover, ...], arguments: argparse.Namespace, out: Path, began: float,
) -> int:
    reports = [replace(
        report_from_bags(TaskFolder(out / 'bags', task), worlds[task], arguments.seed),
        movers=movers, settings=settings) for task, settings in tasks.items()]
    write_report(out / 'report.json', reports, {
        'trials': arguments.trials, 'profile': arguments.profile, 'seed': arguments.seed,
        'realtime': arguments.realtime, 'seconds': round(time.monotonic() - began, 1)})
    figures = draw_figures(out, reports)
    print('\n'.join(report_lines(reports)))
    print(f'\nwritten in {time.monotonic() - began:.0f} s:')
    for path in (out / 'report.json', *figures, *(out / 'bags' / task for task in tasks)):
        print(f'  {path}')
    if not arguments.page:
        print('\nto watch a robot that fails at first and learns, in a browser: '
              'experience demo --page')
    problems = [problem for report in reports for problem in report.problems()]
    for problem in problems:
        print(f'experience demo: {problem}', file=sys.stderr)
    return 1 if problems else 0
