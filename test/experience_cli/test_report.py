"""What is reported of a task, and drawn of several."""

from dataclasses import replace
from io import BytesIO
import shutil

import numpy as np
import pytest

from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import TaskFolder
from experience_cli.demo.report import report_from_bags, report_lines
from experience_cli.figures.paper_figures import figures_of, final_figure
from sample_helpers import rewritten, sample_copy
from world_maps.movers_file import find_movers, load_movers
from world_maps.world import find_world, load_world

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
              for name, figure in figures_of(reports) if not name.startswith('learning')}
    assert titles.pop('figure_mine') == 'Final control field of mine'
    assert titles == {f'figure_{number}': f'Figure {number}' for number in range(2, 8)}


def test_who_moves_is_drawn_and_what_they_meet_is_no_shortcoming(task):
    movers = load_movers(find_movers('crossing'), WORLD).movers
    report = replace(report_from_bags(task, WORLD, 0), movers=movers)
    report.trials[-1].__dict__['collisions'] = 1
    assert not list(report.problems())
    figure = final_figure('', report)
    assert len(figure.axes[0].patches) == 5
    assert 'who moves' in figure.axes[0].get_legend_handles_labels()[1]
    assert any('while the robot stood' in line for line in report_lines([report]))


def test_what_was_learnt_is_drawn_and_counted(task):
    report = report_from_bags(task, WORLD, 0)
    shares = report.field_success()
    assert len(shares) == 1 + len(report.trials)
    assert all(0.0 <= share <= 1.0 for share in shares)
    assert report.to_json()['field_success'] == shares
    figures = dict(figures_of([report]))
    before, after = figures[f'learning_{report.name}'].axes
    for axes, share in ((before, shares[0]), (after, shares[-1])):
        n_home = round(share * int(report.reachable.sum()))
        assert f'from {n_home} of {int(report.reachable.sum())} places' in axes.get_title('left')
    [line] = figures['learning'].axes[0].lines
    np.testing.assert_allclose(line.get_ydata(), np.multiply(shares, 100.0))
    assert line.get_xdata()[0] == 0


def test_every_mark_stands_in_the_legend(task):
    report = report_from_bags(task, WORLD, 0)
    always = {'heading (faint: prototypes disagree)', 'goal', 'start', 'demonstration'}
    demonstrated = 'prototype, demonstrated'
    own = {'figure_2': {demonstrated}, 'figure_3': {'wall', demonstrated},
           f'learning_{report.name}': {'wall', 'the arrows lead to the goal'}}
    figures = dict(figures_of([report]))
    for name, marks in own.items():
        [legend] = figures[name].legends
        labels = {text.get_text() for text in legend.get_texts()}
        assert always | marks <= labels
        # No picture has to be cut for it, nor does it cover the axes.
        figures[name].savefig(BytesIO())
        box = legend.get_window_extent()
        assert box.x0 >= 0.0
        assert box.x1 <= figures[name].bbox.x1
        assert all(box.y1 <= axes.get_window_extent().y0 for axes in figures[name].axes)


def test_every_trial_is_a_row_of_the_table_below_a_sentence_for_its_task(task):
    report = report_from_bags(task, WORLD, 0)
    lines = list(report_lines([report]))
    assert lines[1].startswith('sample: From ')
    titles = next(i for i, line in enumerate(lines) if line.startswith('task  '))
    assert lines[titles].split() == ['task', 'trial', 'steps', 'prototypes', 'reinforcements',
                                     'collisions', 'outcome', 'seconds']
    rows = [line.split() for line in lines[titles + 1:] if line.startswith('sample ')]
    assert rows == [
        ['sample', str(trial.trial), str(trial.steps), str(trial.hidden_neurons),
         str(trial.reinforcements), str(trial.collisions), 'goal', f'{trial.seconds:.1f}']
        for trial in report.trials]
    assert len(rows) == 2


def test_with_settings_of_its_own_a_task_may_fail_at_first_and_must_not_in_the_end(task):
    report = report_from_bags(task, WORLD, 0)
    first, last = report.trials
    failed = [replace(first, outcome='gave_up'), last]
    report = replace(report, trials=failed, settings={'step_limit': 50})
    assert not list(report.problems())
    assert report.to_json()['settings'] == {'step_limit': 50}
    [axes] = dict(figures_of([report]))['figure_5'].axes
    marks = axes.lines[-1]
    assert marks.get_label() == 'the goal was not reached'
    assert (list(marks.get_xdata()), list(marks.get_ydata())) == ([1], [first.steps])
    report = replace(report, trials=failed[::-1])
    assert any('last trial' in problem for problem in report.problems())
