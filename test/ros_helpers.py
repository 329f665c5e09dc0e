"""Real processes and real topics for tests: start, wait with a deadline, stop, look."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
import json
import math
import os
from pathlib import Path
import signal
import subprocess
import time
from typing import Any, TypeVar

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

import forks

ROOT = Path(__file__).resolve().parent.parent
#: Ends a test that has failed; what is waited for may take long on a busy machine, [s].
DEADLINE = 60.0
#: Time after which a lost request is made again, [s].
REPEAT = 3.0
#: Services that do nothing more when they are asked a second time.
REPEATABLE = {'start_trial', 'stop_trial', 'stop_trials', 'record_demonstration',
              'discard_demonstration', 'label_success', 'label_failure'}

Result = TypeVar('Result')


def listen_to_interrupts() -> None:
    """Let SIGINT through to children: a shell's background job ignores it, they inherit that."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def hearing_hangups() -> Iterator[None]:
    """Let children hear SIGHUP, also where the tests run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGHUP, before)


@contextmanager
def own_node(domain: int, name: str = 'test_node', **options: Any) -> Iterator[Node]:
    """Make a node with a context and an executor of its own; `options` go to `Node`."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    executor = SingleThreadedExecutor(context=context)
    node = Node(name, context=context, use_global_arguments=False, **options)
    executor.add_node(node)
    try:
        yield node
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()


def spin_some(node: Node, seconds: float = 0.02) -> None:
    """Let a node handle what waits, or wait that long for something."""
    if node.executor is not None:
        node.executor.spin_once(timeout_sec=seconds)
    else:
        rclpy.spin_once(node, timeout_sec=seconds)


def wait_until(
    predicate: Callable[[], Result], deadline: float = DEADLINE, *, node: Node | None = None,
    processes: Sequence['Process'] = (), what: str = 'what was waited for',
    report: Callable[[], str] = str,
) -> Result:
    """
    Wait until `predicate` returns something true and return that, spinning `node` meanwhile.

    Parameters
    ----------
    predicate : callable without arguments
    deadline : float, [s]
    node : Node, optional
        Spun while waiting.
    processes : sequence of Process
        Waiting is over at once, with what they said, when one of them ends.
    what : str
        Named in the error.
    report : callable without arguments
        Says more in the error.

    Raises
    ------
    AssertionError
        If the deadline passes, or a process ends.

    """
    end = time.monotonic() + deadline
    while True:
        result = predicate()
        if result:
            return result
        for process in processes:
            assert process.running, f'waiting for {what}: {process.report()}'
        if time.monotonic() > end:
            reports = '\n'.join([report(), *(process.report() for process in processes)])
            raise AssertionError(f'{what} did not come within {deadline} s\n{reports}')
        if node is None:
            time.sleep(0.01)
        else:
            spin_some(node)


def collect(node: Node, message_type: type, topic: str, qos: QoSProfile | int = 10) -> list[Any]:
    """Subscribe; return the list that the messages are appended to."""
    messages: list[Any] = []
    node.create_subscription(message_type, topic, messages.append, qos)
    return messages


def client_of(node: Node, service_type: type, name: str) -> Any:
    """Return a node's client of a service, the same for every request."""
    full = node.resolve_service_name(name)
    return next((client for client in node.clients if client.service_name == full),
                None) or node.create_client(service_type, name)


def call(
    node: Node, service_type: type, name: str, request: Any = None, deadline: float = DEADLINE,
    again: float | None = None,
) -> Any:
    """
    Call a service (an empty request by default) and return its response.

    A client's first request, or the answer to it, may be lost: the server may hear of the client
    later than of the request. So a node keeps its clients, and what may be asked for twice (any
    parameter, and `REPEATABLE`) is asked for again after `again` seconds without an answer.
    """
    if again is None and (service_type.__module__.startswith('rcl_interfaces')
                          or name.rpartition('/')[2] in REPEATABLE):
        again = REPEAT
    client = client_of(node, service_type, name)
    wait_until(client.service_is_ready, deadline, node=node, what=f'service {name}')
    futures: list[Any] = []
    asked = -math.inf

    def answered() -> Any:
        nonlocal asked
        if not futures or (again is not None and time.monotonic() - asked > again):
            futures.append(client.call_async(
                service_type.Request() if request is None else request))
            asked = time.monotonic()
        return next((future for future in futures if future.done()), None)

    return wait_until(answered, deadline, node=node, what=f'an answer of {name}').result()


class Process:
    """
    A child process with its output in files; as a context it is stopped at the end.

    Leaving the context after an error kills it; else it is stopped with SIGINT and has to return
    `expected` (0 unless it is set) unless it has ended and been looked at before.
    """

    def __init__(
        self, command: Sequence[str], folder: Path, env: Mapping[str, str] | None = None,
        cwd: Path = ROOT, name: str | None = None,
    ) -> None:
        self.name = name or Path(command[0]).name
        stem = f'{self.name}_{time.monotonic_ns()}'
        self._stdout, self._stderr = folder / f'{stem}.out', folder / f'{stem}.err'
        listen_to_interrupts()
        with self._stdout.open('wb') as out, self._stderr.open('wb') as err, hearing_hangups():
            if forks.is_forkable(command, env):
                self.popen = fork_server().start(
                    command, (os.devnull, self._stdout, self._stderr), cwd,
                    child_environment(env))
            else:
                self.popen = subprocess.Popen(
                    list(command), stdin=subprocess.DEVNULL, stdout=out, stderr=err, cwd=cwd,
                    env=child_environment(env), start_new_session=True)

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self.popen.poll() is None

    @property
    def stdout(self) -> str:
        """What it wrote to standard output so far."""
        return self._stdout.read_text(errors='replace')

    @property
    def stderr(self) -> str:
        """What it wrote to standard error so far."""
        return self._stderr.read_text(errors='replace')

    def report(self) -> str:
        """Say how it stands and what it wrote, for a failing test."""
        state = 'runs' if self.running else f'ended with {self.popen.returncode}'
        return f'{self.name} {state}\nstdout: {self.stdout}\nstderr: {self.stderr}'

    def send(self, number: int) -> None:
        """Send a signal."""
        self.popen.send_signal(number)

    def wait(self, deadline: float = DEADLINE) -> int:
        """Return its exit code; kill it and fail if it does not end in time."""
        try:
            return self.popen.wait(deadline)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError(f'{self.report()}\ndid not end within {deadline} s') from None

    def stop(self, number: int = signal.SIGINT, deadline: float = DEADLINE) -> None:
        """Stop it with a signal and check that it ends with exit code 0."""
        if self.running:
            self.send(number)
        assert self.wait(deadline) == 0, self.report()

    def kill(self) -> None:
        """End it and its children at once."""
        with suppress(ProcessLookupError):
            os.killpg(self.popen.pid, signal.SIGKILL)
        self.popen.wait()

    def __enter__(self) -> 'Process':
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if kind is None and self.running:
            self.stop()
        self.kill()


@cache
def fork_server() -> forks.Server:
    """Return the server of this worker's forked processes."""
    return forks.Server(child_environment())


def end_fork_server() -> None:
    """Let it end, if there is one."""
    if fork_server.cache_info().currsize:
        fork_server().end()
        fork_server.cache_clear()


def child_environment(env: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return this process' environment, unbuffered, with the tree importable, and `env` on top."""
    ours = {name: text for name, text in os.environ.items() if not name.startswith('PYTEST_')}
    path = os.pathsep.join(filter(None, (str(ROOT), ours.get('PYTHONPATH'))))
    return {**ours, 'PYTHONUNBUFFERED': '1', 'PYTHONPATH': path, **(env or {})}


def node_command(
    module: str, folder: Path, parameters: Mapping[str, Any] | None = None, *,
    remappings: Mapping[str, str] | None = None, namespace: str | None = None,
    name: str | None = None, arguments: Sequence[str] = (),
) -> list[str]:
    """Return the command that runs `module`.main with these ROS arguments."""
    ros = []
    if parameters:
        path = folder / f'{module}_{time.monotonic_ns()}.yaml'
        path.write_text(json.dumps({'/**': {'ros__parameters': dict(parameters)}}))
        ros += ['--params-file', str(path)]
    for key, value in {'__ns': namespace, '__node': name, **(remappings or {})}.items():
        ros += ['-r', f'{key}:={value}'] if value is not None else []
    return forks.command(module, *arguments, *(['--ros-args', *ros] if ros else []))


def start_node(
    module: str, folder: Path, parameters: Mapping[str, Any] | None = None, *,
    env: Mapping[str, str] | None = None, **options: Any,
) -> Process:
    """
    Start a node in a process of its own.

    Parameters
    ----------
    module : str
        The module that has `main`, for example `sim_node.node`.
    folder : Path
        For its output and parameter file: `tmp_path`.
    parameters : mapping, optional
        ROS parameters. A float has to be one (1.0, not 1).
    env : mapping, optional
        Environment variables on top of this process' own.
    **options
        `remappings`, `namespace`, `name`, `arguments`, see `node_command`.

    Returns
    -------
    Process
        Use it as a context.

    """
    command = node_command(module, folder, parameters, **options)
    return Process(command, folder, env, name=options.get('name') or module.split('.')[0])


def run(
    command: Sequence[str], folder: Path, env: Mapping[str, str] | None = None,
    deadline: float = DEADLINE, cwd: Path = ROOT,
) -> Process:
    """Run a command to its end; look at `popen.returncode`, `stdout` and `stderr`."""
    process = Process(command, folder, env, cwd)
    process.wait(deadline)
    return process
