"""What is reported of a task, and drawn of several."""

from dataclasses import replace
import shutil

import pytest

from experience_cli.figures import figures_of
from experience_cli.report import report_from_bags
from msgs_bridge.bag_folder import BagError, TaskFolder
from sample_helpers import rewritten, sample_copy
from sim_node.world import find_world, load_world

WORLD = load_world(find_world('task1'))


@pytest.fixture
def task(tmp_path):
    return sample_copy(tmp_path)


def without_motion(task, number):
    """Record a bag anew in which nothing is seen to move: nothing can be learnt from it."""
    return rewritten(task, number, lambda topic, type_name, message: [
        (topic, type_name, message)] if topic not in ('/odom', '/experience', '/trial') else [])


def test_a_demonstration_that_was_not_kept_is_no_trial_that_was_broken_off(task):
    without_motion(task, 1)
    assert report_from_bags(task, WORLD, 0).n_aborted == 0
    without_motion(task, 3)
    report = report_from_bags(task, WORLD, 0)
    assert (report.n_aborted, len(report.trials)) == (1, 2)


def test_without_a_demonstration_there_is_nothing_to_report(task):
    with pytest.raises(BagError, match='holds no bags'):
        report_from_bags(TaskFolder(task.path.parent, 'empty'), WORLD, 0)
    shutil.rmtree(task.find(1).path)
    with pytest.raises(BagError, match='no demonstration that was kept'):
        report_from_bags(task, WORLD, 0)


def test_a_third_tasks_picture_has_no_number_of_the_papers(task):
    report = report_from_bags(task, WORLD, 0)
    reports = [replace(report, name=name) for name in ('task1', 'task2', 'mine')]
    titles = {name: figure.axes[0].get_title(loc='left').split('  ')[0]
              for name, figure in figures_of(reports)}
    assert titles.pop('figure_mine') == 'Final control field of mine'
    assert titles == {f'figure_{number}': f'Figure {number}' for number in range(2, 8)}
