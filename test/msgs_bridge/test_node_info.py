"""What the nodes of a suite say of themselves, and what of it does not fit."""

from dataclasses import replace

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
import pytest

from control_field.grid import Grid
from control_field.parameters import Parameters
from msgs_bridge.node.node_info import (
    conflicts, method_from_parameters, node_info_from_status, NodeInfo, Operation,
    values_from_node_info, workspace_from_grid)

GRID = Grid(20, 20, 0.25)


def said(name, role, *, grid=None, parameters=None, number=1):
    return NodeInfo(name, role, f'host-{number}-ab', None if grid is None else (
        workspace_from_grid(grid)), None if parameters is None else (
        method_from_parameters(parameters)))


def suite(world=GRID, local_grid=GRID, controller=None):
    return [said('/learner_node', 'learner', grid=GRID, parameters=Parameters()),
            said('/control_field_node', 'controller', parameters=controller or Parameters()),
            said('/sim_node', 'robot', grid=world),
            said('/neighbourhood_node', 'sight', grid=local_grid)]


def status(info, **values):
    values = {**values_from_node_info(info), **values}
    return DiagnosticStatus(name=f'{info.name.lstrip("/")}: {info.role}', values=[
        KeyValue(key=key, value=value) for key, value in values.items()])


@pytest.mark.parametrize('info', suite())
def test_a_description_comes_through(info):
    assert node_info_from_status(status(info)) == info


@pytest.mark.parametrize('workspace', [
    '', '[1]', 'x', '{"rows": 1}', '{"rows": NaN}', '[' * 3000,
    '{"rows": 1, "cols": 1, "resolution": 0.0, "origin_x": 0, "origin_y": 0, "frame_id": "a"}',
    '{"rows": "a", "cols": 1, "resolution": 1, "origin_x": 0, "origin_y": 0, "frame_id": "a"}',
    '{"rows": 1, "cols": 1, "resolution": 1, "origin_x": 1e999, "origin_y": 0, "frame_id": "a"}',
    '{"rows": 1' + '0' * 400 + '}'])
def test_a_workspace_that_makes_no_sense_is_none(workspace):
    info = node_info_from_status(status(suite()[0], workspace=workspace))
    assert info.workspace is None
    assert not conflicts([info, *suite()[1:]])


def test_what_is_no_statement_is_passed_over():
    assert node_info_from_status(DiagnosticStatus(name='battery: robot')) is None
    assert node_info_from_status(status(said('/a', 'motor'))) is None


def test_a_suite_that_fits_has_nothing_to_say():
    assert conflicts(suite()) == []


@pytest.mark.parametrize(('world', 'remedy', 'stops'), [
    (Grid(20, 20, 1.0), 'restart learner_node with -p resolution:=1.0, or sim_node with', True),
    (Grid(20, 20, 0.25, 0.1, 0.0), 'restart learner_node with -p origin_x:=0.1, or', True),
    (Grid(20, 20, 0.25, frame_id='map'), 'learner_node with -p frame_id:=map, or', True),
    (Grid(40, 20, 0.25, -2.5, 0.0), 'with -p rows:=40 -p origin_x:=-2.5, or', False)])
def test_another_world_than_the_learners_is_named_with_what_to_set(world, remedy, stops):
    [problem] = conflicts(suite(world=world))
    assert 'sim_node and learner_node have different workspaces' in problem.text
    assert remedy in problem.text
    prevented = (Operation.TEACH, Operation.DRIVE) if stops else ()
    assert problem.prevents == frozenset(prevented)


def test_a_local_grid_of_other_cells_can_be_set_right_on_either_side():
    [problem] = conflicts(suite(local_grid=replace(GRID, resolution=0.5)))
    assert ('restart learner_node with -p resolution:=0.5, or neighbourhood_node with -p '
            'resolution:=0.25') in problem.text


def test_without_a_learner_simulator_and_local_grid_are_compared():
    [problem] = conflicts(suite(local_grid=replace(GRID, resolution=0.5))[1:])
    assert 'neighbourhood_node and sim_node have different workspaces' in problem.text


def test_other_parameters_of_the_method_are_named_with_what_to_set():
    [problem] = conflicts(suite(controller=replace(
        Parameters(), unknown_is_blocked=True, profile='paper')))
    assert 'control_field_node and learner_node have different parameters' in problem.text
    assert 'profile paper and full' in problem.text
    assert ('restart control_field_node with -p profile:=full -p unknown_is_blocked:=false, or '
            'learner_node with -p profile:=paper -p unknown_is_blocked:=true') in problem.text
    assert problem.prevents == {Operation.DRIVE}


def test_two_of_one_role_are_two_suites():
    [problem] = conflicts([*suite(), said('/learner_b', 'learner', grid=GRID,
                                        parameters=Parameters(), number=7)])
    assert ('2 learners in one namespace: /learner_b (process 7 on host) and /learner_node '
            '(process 1 on host)') in problem.text
    assert 'ROS_DOMAIN_ID' in problem.text
    assert '-r __ns:=' in problem.text
    assert problem.prevents == frozenset(Operation)


def test_a_name_cannot_command_a_terminal():
    [problem] = conflicts([*suite(), said('/\x1b[2J', 'learner', number=2)])
    assert '\x1b' not in problem.text


def fitting(name, role, grid, number=1):
    return NodeInfo(name, role, f'host-{number}-ab', workspace_from_grid(grid, is_fitted=True))


@pytest.mark.parametrize('ours', [Grid(64, 40, 0.25, -4.0, -2.0), Grid(1, 1, 0.25)])
@pytest.mark.parametrize('theirs', [Grid(20, 20, 0.25), Grid(9, 7, 0.25, 12.5, -3.75)])
def test_of_a_workspace_that_fits_itself_only_the_cells_have_to_be_the_same(ours, theirs):
    learner = fitting('/learner_node', 'learner', ours)
    assert node_info_from_status(status(learner)) == learner
    assert not conflicts([learner, said('/sim_node', 'robot', grid=theirs)])
    assert not conflicts([learner, fitting('/neighbourhood_node', 'sight', theirs, 2)])


@pytest.mark.parametrize(('theirs', 'remedy'), [
    (Grid(20, 20, 0.4), 'with -p resolution:=0.25 or learner_node with another task'),
    (Grid(20, 20, 0.25, frame_id='map'), 'neighbourhood_node with -p frame_id:=odom or'),
    (Grid(20, 20, 0.25, 0.125), 'with rows, cols and an origin on these cells or')])
def test_other_cells_than_those_of_what_was_learnt_are_named_with_what_to_set(theirs, remedy):
    [problem] = conflicts([fitting('/learner_node', 'learner', Grid(8, 8, 0.25, -1.0)),
                           said('/neighbourhood_node', 'sight', grid=theirs)])
    assert 'neighbourhood_node and learner_node have different cells' in problem.text
    assert remedy in problem.text
    assert problem.prevents == {Operation.TEACH, Operation.DRIVE}


def test_beside_a_learner_that_has_no_cells_yet_simulator_and_local_grid_are_compared():
    learner = said('/learner_node', 'learner', parameters=Parameters(), number=3)
    others = [said('/sim_node', 'robot', grid=GRID),
              fitting('/neighbourhood_node', 'sight', Grid(1, 1, 0.5), 2)]
    [problem] = conflicts([learner, *others])
    assert 'neighbourhood_node and sim_node have different cells' in problem.text
    assert not conflicts([learner, others[0], fitting('/n', 'sight', Grid(1, 1, 0.25), 2)])


def test_a_local_grid_without_bounds_must_have_the_cells_of_the_simulator():
    [problem] = conflicts([said('/sim_node', 'robot', grid=Grid(20, 20, 0.5)),
                           fitting('/neighbourhood_node', 'sight', Grid(1, 1, 0.25))])
    assert ('restart neighbourhood_node with -p resolution:=0.5 or sim_node with -p '
            'resolution:=0.25') in problem.text
