"""What of a drive is not learnt is drawn and listed."""

from dataclasses import replace
from itertools import pairwise

from matplotlib.colors import to_rgba
import numpy as np
import pytest

from bridge_helpers import content_of, GRID, nanoseconds, ODOMETRY, raw_odometry
from control_field.parameters import Parameters
from episode_store.episode import Episode
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.relearn import Relearner
from episode_store.task_folder import episode_from_path, TaskFolder
from experience_cli.figures import drawing
from experience_cli.figures.inspection_figure import inspection_figure
from experience_cli.main import main

LOOP, SPIKE = 'a loop, cut out: not learnt', 'pose far off, left out'
CORNERS = [(0.6, 0.6), (2.1, 0.6), (2.1, 2.1), (1.1, 2.1), (1.1, 0.6), (1.1, 0.1)]


def record(root, corners, spike=False):
    segments = [np.linspace(first, last, 60, endpoint=False)
            for first, last in pairwise(corners)]
    way = np.concatenate(segments)
    if spike:
        way[30] = 4.0, 4.0
    header = EpisodeHeader('demo', 'task1', GRID).to_mapping()
    with start_bag(TaskFolder(root, 'task1'), 'demo', header) as bag:
        for i, (x, y) in enumerate(way.tolist()):
            bag.write('/odom', ODOMETRY, raw_odometry(i / 10, x, y), nanoseconds(i / 10))
    return episode_from_path(bag.folder)


@pytest.mark.parametrize(('corners', 'spike', 'drawn'), [
    (CORNERS[:3], False, set()), (CORNERS, False, {LOOP}), (CORNERS, True, {LOOP, SPIKE})])
def test_it_is_drawn_in_a_style_of_its_own(tmp_path, corners, spike, drawn):
    relearner = Relearner(GRID, Parameters())
    learnt_bag = relearner.learn(Episode(record(tmp_path, corners, spike)))
    figure = inspection_figure(learnt_bag, relearner)
    for axes in figure.axes:
        lines = {line.get_label(): line for line in axes.lines}
        assert lines.keys() & {LOOP, SPIKE} == drawn
        path = lines[f'driven in {learnt_bag.folder.name}'].get_xydata()
        assert not (np.abs(path - 4.0) < 1e-6).all(axis=1).any()
        if LOOP in drawn:
            in_loop = np.isfinite(lines[LOOP].get_xydata()).all(axis=1)
            assert 0.6 < in_loop.mean() < 0.95
            assert (in_loop & np.isfinite(path).all(axis=1)).sum() == 1
    [legend] = figure.legends
    assert drawn <= {text.get_text() for text in legend.get_texts()}


def test_walls_in_doubt_are_drawn_as_such(tmp_path):
    relearner = Relearner(GRID, Parameters())
    learnt_bag = relearner.learn(Episode(record(tmp_path, CORNERS[:3])))
    known = relearner.refresh.field.known.copy()
    known[0, :3], known[1, :4] = 100, 60
    relearner._learner.refresh = replace(
        relearner.refresh, field=replace(relearner.refresh.field, known=known))
    figure = inspection_figure(learnt_bag, relearner)
    for axes in figure.axes:
        masks = {tuple(image.get_cmap()(1.0)): int(image.get_array().sum())
                 for image in axes.images}
        assert masks[to_rgba(drawing.WALL)] == 3
        assert masks[to_rgba(drawing.DOUBTED)] == 4
        assert any(line.get_marker() == '$?$' and len(line.get_xydata()) == 4
                   for line in axes.lines)
    [legend] = figure.legends
    assert any('in doubt' in text.get_text() for text in legend.get_texts())


def test_show_lists_every_loop_and_counts_the_steps_that_are_left(tmp_path, capsys):
    report = content_of(record(tmp_path, CORNERS).path).report
    assert main(['show', '--bags', str(tmp_path), 'task1/0001']) == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert f', {report.n_steps} steps to learn from' in first
    assert report.n_steps < report.n_cells - 5
    assert 's  a loop of ' in second
    assert second.endswith('m back to it: cut out')
