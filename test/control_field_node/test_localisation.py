import ast
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.localisation import Bench, Condition, SLIP
from control_field.robot import policy
from control_field_node.driving import trial_run
from control_field_node.inputs import localisation
from control_field_node.inputs.localisation import Localisation
from control_field_node.settings import DECISION_PARAMETERS, Settings
from controller_helpers import straight_field
from msgs_bridge.messages.neighbourhoods import Neighbourhood
from msgs_bridge.messages.poses import Pose

FREE = np.zeros((3, 3), np.int8)


def ready(**settings):
    where = Localisation(Settings(**settings), 0)
    where.take_field(straight_field((5, 9)))
    return where


def pose_at(stamp, x, y=1.375, yaw=0.0):
    return Pose(stamp, x, y, yaw)


def test_switched_off_everything_is_handed_on_as_it_came():
    where = ready()
    pose, seen = pose_at(1.0, 0.9), Neighbourhood(1.0, 5, 3, FREE)
    assert where.place(pose, seen) is pose
    assert where.moved(seen) is seen
    assert not where.is_lost


def test_before_there_is_a_field_everything_is_handed_on():
    where = Localisation(Settings(anchoring=True), 0)
    pose = pose_at(1.0, 0.9)
    assert where.place(pose, None) is pose


def test_a_step_that_no_wheel_makes_is_a_new_beginning():
    where = ready(anchoring=True)
    where.place(pose_at(1.0, 0.875), None)
    for k in range(1, 20):
        where.place(pose_at(1.0 + 0.05 * k, 0.875 + 0.01 * k), None)
    set_back = where.place(pose_at(2.0, 3.125, 2.0, 1.0), None)
    assert (set_back.x, set_back.y) == (pytest.approx(3.125, abs=0.003),
                                        pytest.approx(2.0, abs=0.003))
    assert set_back.yaw == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize('change', [
    {'stamp': 0.9}, {'x': 1.2}, {'yaw': 1.0}], ids=['back in time', 'far away', 'turned'])
def test_after_a_new_beginning_the_robot_is_lost_until_a_pose_arrives(change):
    where = ready(pose_topic='amcl_pose')
    where.place(pose_at(1.0, 0.875), None)
    where.correct(Pose(1.0, 2.0, 3.0, 0.5), (1e-4, 1e-4, 1e-4))
    where.place(pose_at(1.05, 0.885), None)
    assert not where.is_lost
    where.place(dataclasses.replace(pose_at(1.1, 0.895), **change), None)
    assert where.is_lost


def test_driving_at_full_speed_is_no_new_beginning():
    where = ready(pose_topic='amcl_pose')
    where.place(pose_at(1.0, 0.875), None)
    where.correct(Pose(1.0, 2.0, 3.0, 0.5), (1e-4, 1e-4, 1e-4))
    where.place(pose_at(2.0, 0.875 + 0.22, yaw=2.84), None)
    assert not where.is_lost


def test_a_late_pose_is_turned_with_the_robot():
    where = ready(pose_topic='amcl_pose')
    for k in range(21):
        where.place(pose_at(1.0 + 0.05 * k, 0.875, 1.375 + 0.01 * k, 1.0), None)
    assert where.correct(Pose(1.5, 2.0, 3.0, 0.3), (1e-4, 1e-4, 1e-4))
    pose = where.place(pose_at(2.0, 0.875, 1.575, 1.0), None)
    ahead, left = 0.1 * math.sin(1.0), 0.1 * math.cos(1.0)
    assert (pose.x, pose.y) == (
        pytest.approx(2.0 + ahead * math.cos(0.3) - left * math.sin(0.3), abs=0.005),
        pytest.approx(3.0 + ahead * math.sin(0.3) + left * math.cos(0.3), abs=0.005))


def test_the_local_grid_belongs_around_the_robot():
    where = ready(anchoring=True)
    where.place(pose_at(1.0, 0.875), None)
    assert (where.moved(Neighbourhood(1.0, 5, 4, FREE)).row,
            where.moved(Neighbourhood(1.0, 5, 4, FREE)).col) == (5, 3)


def test_transforms_are_no_poses():
    with pytest.raises(ValueError, match='localised_odometry_node takes /tf'):
        Settings(pose_topic='/tf')


def test_with_a_pose_topic_the_robot_is_lost_until_a_pose_arrives():
    where = ready(pose_topic='amcl_pose')
    where.place(pose_at(1.0, 0.875), None)
    assert where.is_lost
    assert where.correct(Pose(1.0, 2.0, 3.0, 0.5), (1e-4, 1e-4, 1e-4))
    assert not where.is_lost
    pose = where.place(pose_at(1.05, 0.875), None)
    assert (pose.x, pose.y, pose.yaw) == (pytest.approx(2.0, abs=0.003),
                                          pytest.approx(3.0, abs=0.003),
                                          pytest.approx(0.5, abs=0.005))
    assert pose.stamp == 1.05


def test_a_late_pose_is_brought_up_to_date_and_one_that_comes_twice_is_passed_over():
    where = ready(pose_topic='amcl_pose')
    for k in range(21):
        where.place(pose_at(1.0 + 0.05 * k, 0.875 + 0.01 * k), None)
    late = Pose(1.5, 2.0, 3.0, math.pi / 2)
    assert where.correct(late, (1e-4, 1e-4, 1e-4))
    assert not where.correct(late, (1e-4, 1e-4, 1e-4))
    pose = where.place(pose_at(2.05, 1.075), None)
    assert (pose.x, pose.y) == (pytest.approx(2.0, abs=0.005), pytest.approx(3.1, abs=0.005))


def test_a_pose_from_before_anything_is_known_is_of_no_use():
    where = ready(pose_topic='amcl_pose')
    assert not where.correct(Pose(1.0, 2.0, 3.0, 0.0), (1e-4, 1e-4, 1e-4))
    where.place(pose_at(10.0, 0.875), None)
    assert not where.correct(Pose(1.0, 2.0, 3.0, 0.0), (1e-4, 1e-4, 1e-4))


def rides(task, seed, n_trials=1, localised=False, wheels=SLIP, **settings):
    return list(Bench(task, Condition('', wheels, settings, localised), seed).run(n_trials))


def test_slip_leads_odometry_astray_and_anchoring_mends_it():
    """Task 2 passes two obstacles and a door on its way: there is much to hold on to."""
    plain = rides('task2', 1)
    mended = rides('task2', 1, anchoring=True)
    assert plain[0].worst > 0.15
    assert mended[0].is_success()
    assert math.hypot(mended[0].off_x, mended[0].off_y) < 0.1
    assert mended[0].room > 0.025


def test_localisation_and_local_grid_together_are_as_good_as_exact_wheels():
    ride = rides('task1', 2, localised=True, anchoring=True, pose_topic='amcl_pose')[0]
    assert ride.is_success()
    assert math.hypot(ride.off_x, ride.off_y) < 0.05
    assert ride.steps == 18


def test_exact_wheels_do_not_need_it_and_are_not_harmed():
    ride = rides('task2', 0, wheels={}, anchoring=True)[0]
    assert ride.is_success()
    assert ride.steps == rides('task2', 0, wheels={})[0].steps


def test_two_equal_runs_are_equal():
    first, second = (rides('task1', 5, anchoring=True) for _ in range(2))
    assert [dataclasses.replace(ride, micros=0.0) for ride in first] == [
        dataclasses.replace(ride, micros=0.0) for ride in second]


def test_every_parameter_that_decisions_depend_on_is_a_parameter_of_the_controller():
    used = set()
    for module in (policy, trial_run, localisation):
        for node in ast.walk(ast.parse(Path(module.__file__).read_text())):
            if isinstance(node, ast.Attribute) and (
                    ast.unparse(node.value) in ('parameters', 'self._parameters')):
                used.add(node.attr)
    assert used
    assert used <= set(DECISION_PARAMETERS)
