"""A workspace that fits itself, on real nodes: taught anywhere, tried from afar, taught on."""

from contextlib import ExitStack
from itertools import pairwise

import numpy as np
from PIL import Image
import pytest

from control_field.records import Outcome
from episode_store.episode import Episode
from experience_cli.commands.learn import field_bytes
from experience_cli.demo.path_follower import Driver
from experience_cli.main import main
from msgs_bridge.messages.tables import field_from_cloud
from suite_helpers import relearnt, Suite

pytestmark = pytest.mark.slow

#: Cells whose corners lie nowhere in particular, all at negative coordinates.
ORIGIN, SIDE = (-16.07, -11.03), 0.25
#: Where the robot begins, the centre of a cell, and a place that no drive came near.
START, FAR = (-10.945, -5.905), (-6.945, -1.905)


@pytest.fixture
def world(tmp_path):
    """Return a room of 15 x 10 m with a pillar."""
    pixels = np.full((40, 60), 255, np.uint8)
    pixels[18, 24] = pixels[0] = pixels[-1] = 0
    Image.fromarray(pixels).save(tmp_path / 'room.png')
    path = tmp_path / 'room.yaml'
    path.write_text(f'image: room.png\nresolution: {SIDE}\norigin: [{ORIGIN[0]}, {ORIGIN[1]}, 0]\n'
                    f'negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n')
    return path


def show(suite, *steps):
    """Drive a demonstration by steps ``(x, y)``, [m], from where the robot is."""
    place = suite.node.odometry.pose.pose.position
    points = [(place.x, place.y)]
    for x, y in steps:
        points.append((points[-1][0] + x, points[-1][1] + y))
    suite.node.ask('learner_node/record_demonstration', True)
    suite.node.drive(Driver(points), lambda share: None)
    suite.node.ask('learner_node/record_demonstration', False)


def test_what_grew_while_it_was_taught_and_tried_is_what_the_bags_teach(
    ros_domain, tmp_path, world, capsys,
):
    with ExitStack() as stack:
        suite = Suite(tmp_path, ros_domain, stack, start_poses=[*FAR, 0.0], auto_trials=1)
        suite.start('sim_node', world=str(world), start_x=START[0], start_y=START[1])
        suite.start('control_field_node', 'learner_node')
        suite.node.wait_for_peers()
        show(suite, (0.75, 0.0))
        suite.node.ask('learner_node/run_trials')
        suite.wait_for_revision(2)
        show(suite, (-0.5, 0.0), (0.0, -3.5))
        suite.wait(lambda: suite.newest_revision() == 3, 'the last field')
        fields, live, task = [*suite.fields], suite.live_bytes(), suite.task
    fold = relearnt(task)
    assert field_bytes(fold.field()) == live
    demo, trial, other = (Episode(folder) for folder in task.episodes())
    assert trial.content.record.outcome is Outcome.GOAL
    assert all(each.header.fitted for each in (demo, trial, other))
    grids = [demo.header.grid, trial.header.grid, other.header.grid, fold.grid]
    for before, after in pairwise(grids):
        offset = before.offset_to(after)
        assert offset is not None
        assert min(offset) >= 0
    # What was driven on held the robot from the beginning, where nobody had been.
    assert not grids[0].contains(*grids[0].cell_from_world(*FAR))
    assert grids[1].contains(*grids[1].cell_from_world(*FAR))
    assert grids[3].n_rows > grids[2].n_rows
    first = trial.content.record.decisions[0]
    assert grids[1].world_from_cell(int(first['row']), int(first['col'])) == pytest.approx(FAR)
    goals = {field.grid.world_from_cell(*field.goal) for field in (
        field_from_cloud(cloud) for cloud in fields) if field.revision == 1}
    assert len(goals) == 1
    assert main(['learn', '--check', str(task.path)]) == 0
    assert 'refused' not in capsys.readouterr().out
