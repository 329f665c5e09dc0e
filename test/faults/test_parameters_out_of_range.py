"""Every parameter of every node, out of its range: refused at start and at run time, in a line."""

from contextlib import contextmanager
from dataclasses import fields
import gc
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
from page_node import settings as page
from page_node.node import PageNode
import ros_helpers
from sim_node import settings as simulator
from sim_node.node import SimNode
from teleop_node import settings as teleop
from teleop_node.node import TeleopNode

NODES = {'sim_node': SimNode, 'control_field_node': ControlFieldNode, 'learner_node': LearnerNode,
         'neighbourhood_node': NeighbourhoodNode,
         'localised_odometry_node': LocalisedOdometryNode,
         'page_node': PageNode,
         'teleop_node': lambda **options: TeleopNode(None, **options)}
RECORDS = [
    ('sim_node', simulator.SimSettings, None, simulator.FIXED),
    ('control_field_node', Parameters, controller.DECISION_PARAMETERS, ()),
    ('control_field_node', controller.Settings, None, controller.FIXED),
    ('learner_node', Parameters, None, list(Parameters.__dataclass_fields__)),
    ('learner_node', learner.Settings, None, learner.FIXED),
    ('neighbourhood_node', local_grid.NeighbourhoodSettings, None, local_grid.FIXED),
    ('localised_odometry_node', localised.LocalisedSettings, None, localised.FIXED),
    ('teleop_node', teleop.Settings, None, teleop.FIXED),
    ('page_node', page.Settings, None, page.FIXED),
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


def cases(names, kind, fixed=()):
    """Return parameters, each with values that it cannot have and what a refusal names."""
    found = [(spec.name, value, words) for spec in fields(kind) for value, words in values_outside(
        spec) if (names is None or spec.name in names) and spec.name not in fixed]
    assert found
    return found


def is_named(limit, sentence):
    """Tell whether a limit stands in a sentence, however a float is written."""
    return str(limit) in sentence or (isinstance(limit, int | float) and any(
        text in sentence for text in (f'{limit:g}', str(float(limit)), f'{float(limit):f}')))


def is_refusal(sentence, name, words=()):
    """Tell whether a sentence says of a parameter what it has to."""
    return name in sentence and '\n' not in sentence and len(sentence) < 400 and all(
        is_named(word, sentence) for word in words)


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
    # Nodes that were half made are still in the graph, for whoever comes next.
    gc.collect()
    context.try_shutdown()


@contextmanager
def made(name, folder, context, **overrides):
    """Make a node."""
    needed = {'learner_node': {'task': 'a_task', 'bags': str(folder)},
              'teleop_node': {'keyboard': False}, 'page_node': {'port': 0}}
    overrides = {**needed.get(name, {}), **overrides}
    node = None
    try:
        node = NODES[name](
            context=context, use_global_arguments=False, parameter_overrides=[
                Parameter(key, value=value) for key, value in overrides.items()])
        yield node
    finally:
        if node is not None:
            if name in ('learner_node', 'page_node'):
                node.close()
            node.destroy_node()


def refusal_at_start(name, folder, context, **override):
    """Return how a node that is made refuses it; nothing if it does not."""
    try:
        with made(name, folder, context, **override):
            return ''
    except (ValueError, rclpy.exceptions.ParameterException) as error:
        return ' '.join(str(error).split())


@pytest.mark.parametrize(('name', 'kind', 'names', 'fixed'), RECORDS)
def test_at_start_it_is_refused_with_its_range(
        context, tmp_path, name, kind, names, fixed):
    said = {(parameter, str(value), words): refusal_at_start(
        name, tmp_path, context, **{parameter: value})
        for parameter, value, words in cases(names, kind)}
    assert {case: sentence for case, sentence in said.items()
            if not is_refusal(sentence, case[0], case[2])} == {}


@pytest.mark.parametrize(('name', 'kind', 'names', 'fixed'), [
    record for record in RECORDS if set(record[1].__dataclass_fields__) - set(record[3])])
def test_at_run_time_it_is_refused_with_its_range(
        context, tmp_path, name, kind, names, fixed):
    wrong = {}
    with made(name, tmp_path, context) as node:
        for parameter, value, words in cases(names, kind, fixed):
            before = node.get_parameter(parameter).value
            [result] = node.set_parameters([Parameter(parameter, value=value)])
            if result.successful or not is_refusal(result.reason, parameter, words) or (
                    node.get_parameter(parameter).value != before):
                wrong[parameter, str(value)] = result.reason
    assert wrong == {}


@pytest.mark.parametrize(('module', 'parameter', 'value'), [
    ('sim_node.node', 'rate', 0.0), ('control_field_node.node', 'v_max', -1.0),
    ('learner_node.node', 'rows', -1), ('teleop_node.node', 'speed', 99.0),
    ('neighbourhood_node.node', 'rows', -1)])
def test_the_process_says_so_in_one_line_and_ends_with_2(
        quiet_domain, tmp_path, module, parameter, value):
    process = ros_helpers.run(
        ros_helpers.node_command(module, tmp_path, {parameter: value}), tmp_path)
    assert process.popen.returncode == 2
    assert len(process.stderr.splitlines()) == 1, process.stderr
    assert is_refusal(process.stderr.strip(), parameter)
