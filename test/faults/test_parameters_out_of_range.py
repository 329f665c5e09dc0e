"""Every parameter of every node, out of its range: refused at start and at run time, in a line."""

from contextlib import contextmanager
from dataclasses import fields
import math

import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter

from control_field.parameters import Parameters
from control_field_node import settings as controller
from control_field_node.node import ControlFieldNode
from learner_node import settings as learner
from learner_node.node import LearnerNode
from localised_odometry_node import fusion as localised
from localised_odometry_node.node import LocalisedOdometryNode
from neighbourhood_node import settings as local_grid
from neighbourhood_node.node import NeighbourhoodNode
import ros_helpers
from sim_node import parameters as simulator
from sim_node.node import SimNode
from teleop_node import settings as teleop
from teleop_node.node import TeleopNode

NODES = {'sim_node': SimNode, 'control_field_node': ControlFieldNode, 'learner_node': LearnerNode,
         'neighbourhood_node': NeighbourhoodNode,
         'localised_odometry_node': LocalisedOdometryNode,
         'teleop_node': lambda **options: TeleopNode(None, **options)}
RECORDS = [
    ('sim_node', simulator.SimParameters, None, simulator.FIXED),
    ('control_field_node', Parameters, controller.DECISION_PARAMETERS, ()),
    ('control_field_node', controller.Settings, None, controller.FIXED),
    ('learner_node', Parameters, None, list(Parameters.__dataclass_fields__)),
    ('learner_node', learner.Settings, None, learner.FIXED),
    ('neighbourhood_node', local_grid.NeighbourhoodSettings, None, local_grid.FIXED),
    ('localised_odometry_node', localised.LocalisedSettings, None, localised.FIXED),
    ('teleop_node', teleop.Settings, None, teleop.FIXED),
]


def numbers_outside(spec):
    """Return pairs of a number outside a range and what a refusal has to name."""
    low, high, kind = spec.metadata['low'], spec.metadata['high'], type(spec.default)
    step = 1 if kind is int else max(abs(low), abs(high), 1.0) * 1e-3
    if math.isfinite(low):
        yield kind(low - step), (low, high)
    if math.isfinite(high) and high < 2**63 - 1:
        yield kind(high + step), (low, high)
    if kind is float:
        yield math.nan, ()


def values_outside(spec):
    """Return pairs of a value that a parameter cannot have and what a refusal has to name."""
    yield ([1.0, 2.0], ())
    if spec.metadata['choices']:
        yield 'nonsense', spec.metadata['choices']
    if type(spec.default) in (int, float):
        yield from numbers_outside(spec)


def cases(runtime=False):
    for name, record, names, fixed in RECORDS:
        for spec in fields(record):
            if (names is None or spec.name in names) and not (runtime and spec.name in fixed):
                for value, words in values_outside(spec):
                    yield pytest.param(name, spec.name, value, words,
                                       id=f'{name}-{spec.name}-{value}')


def is_named(limit, sentence):
    """Tell whether a limit stands in a sentence, however a float is written."""
    return str(limit) in sentence or (isinstance(limit, int | float) and any(
        text in sentence for text in (f'{limit:g}', str(float(limit)), f'{float(limit):f}')))


def check_refusal(sentence, name, words):
    assert name in sentence
    assert '\n' not in sentence
    assert len(sentence) < 400
    for word in words:
        assert is_named(word, sentence), sentence


@pytest.fixture(scope='module')
def context(quiet_domain):
    """
    Return a context that all nodes share.

    A node in it keeps the participant alive: making and ending hundreds of them in one process
    ends, now and then, in a lock within Fast DDS that nothing opens.
    """
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    keeper = Node('keeper', context=context, use_global_arguments=False)
    yield context
    keeper.destroy_node()
    context.try_shutdown()


@contextmanager
def made(name, folder, context, **overrides):
    """Make a node."""
    needed = {'learner_node': {'task': 'a_task', 'bags': str(folder)},
              'teleop_node': {'keyboard': False}}
    overrides = {**needed.get(name, {}), **overrides}
    node = None
    try:
        node = NODES[name](
            context=context, use_global_arguments=False, parameter_overrides=[
                Parameter(key, value=value) for key, value in overrides.items()])
        yield node
    finally:
        if node is not None:
            if name == 'learner_node':
                node.close()
            node.destroy_node()


@pytest.fixture(scope='module')
def running(context, tmp_path_factory):
    """Return a function that returns a running node by its name, one of each at most."""
    nodes, made_nodes = {}, []

    def node_of(name):
        if name not in nodes:
            made_nodes.append(made(name, tmp_path_factory.mktemp(name), context))
            nodes[name] = made_nodes[-1].__enter__()
        return nodes[name]

    yield node_of
    for node in made_nodes:
        node.__exit__(None, None, None)


@pytest.fixture(scope='module')
def shared(quiet_domain, tmp_path_factory):
    return tmp_path_factory.mktemp('bags')


@pytest.mark.parametrize(('name', 'parameter', 'value', 'words'), list(cases()))
def test_at_start_it_is_refused_with_its_range(shared, context, name, parameter, value, words):
    try:
        with made(name, shared, context, **{parameter: value}):
            pytest.fail(f'{name} starts with {parameter} = {value!r}')
    except (ValueError, rclpy.exceptions.ParameterException) as error:
        check_refusal(' '.join(str(error).split()), parameter, words)


@pytest.mark.parametrize(('name', 'parameter', 'value', 'words'), list(cases(runtime=True)))
def test_at_run_time_it_is_refused_with_its_range(running, name, parameter, value, words):
    node = running(name)
    before = node.get_parameter(parameter).value
    result = node.set_parameters([Parameter(parameter, value=value)])[0]
    assert not result.successful
    check_refusal(result.reason, parameter, words)
    assert node.get_parameter(parameter).value == before


@pytest.mark.parametrize(('module', 'parameter', 'value'), [
    ('sim_node.node', 'rate', 0.0), ('control_field_node.node', 'v_max', -1.0),
    ('learner_node.node', 'rows', 0), ('teleop_node.node', 'speed', 99.0),
    ('neighbourhood_node.node', 'rows', 0)])
def test_the_process_says_so_in_one_line_and_ends_with_2(
        quiet_domain, tmp_path, module, parameter, value):
    process = ros_helpers.run(
        ros_helpers.node_command(module, tmp_path, {parameter: value}), tmp_path)
    assert process.popen.returncode == 2
    assert len(process.stderr.splitlines()) == 1, process.stderr
    check_refusal(process.stderr.strip(), parameter, ())
