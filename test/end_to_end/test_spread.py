"""Trials from starts that the learner chooses, on the real nodes in lock-step."""

import numpy as np
import pytest

from control_field.records import Outcome
from episode_store.episode import find_topic, read_header
from episode_store.relearn import Relearner
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import EpisodeKind
from experience_cli.commands.learn import field_bytes
from msgs_bridge.messages.cdr import POINT_CLOUD, struct_from_cdr
from suite_helpers import running_suite
from world_maps.world import find_world, load_world

pytestmark = pytest.mark.slow
N_TRIALS = 6


@pytest.fixture(scope='module')
def spread(ros_domain, tmp_path_factory):
    """Teach task 1 and run trials from chosen starts; return the task and the live bytes."""
    folder = tmp_path_factory.mktemp('spread') / 'suite'
    with running_suite(folder, ros_domain, starts='spread', auto_trials=N_TRIALS) as suite:
        suite.demonstrate()
        suite.node.ask('learner_node/run_trials')
        suite.wait_for_revision(1 + N_TRIALS)
        suite.wait(lambda: suite.newest_revision() == 1 + N_TRIALS, 'the last field')
        return suite.task, suite.live_bytes()


def fold(task):
    """Learn the bags anew; yield each bag with the fold before it, and the lesson of it."""
    header = read_header(task.episodes()[0].path)
    relearner = Relearner(header.grid, header.parameters)
    for episode in task.episodes():
        curious = field_bytes(relearner.field(curious=True)) if relearner.refresh else b''
        plain = field_bytes(relearner.field()) if relearner.refresh else b''
        ranks = range(400) if relearner.refresh else ()
        asked = [relearner.promising_start(rank) for rank in ranks]
        yield episode, (curious, plain, asked), relearner.learn(episode), relearner


def test_live_and_relearnt_field_are_the_same_bytes(spread):
    task, live = spread
    *_, (_, _, _, relearner) = fold(task)
    assert field_bytes(relearner.field()) == live


def test_the_known_share_of_the_workspace_grows(spread):
    known = [float((learnt_bag.refresh.field.known != -1).mean())
             for _, _, learnt_bag, _ in fold(spread[0])]
    assert known == sorted(known)
    assert known[-1] > known[0] + 0.1


def test_every_start_is_the_best_one_that_is_free(spread):
    occupancy = load_world(find_world('task1')).occupancy
    for episode, (_, _, asked), learnt_bag, relearner in fold(spread[0]):
        if episode.kind is EpisodeKind.DEMO:
            continue
        first = learnt_bag.read.record.decisions[0]
        cells = [relearner.grid.cell_from_world(start.x, start.y) for start in asked]
        start = int(first['row']), int(first['col'])
        rank = cells.index(start)
        # Whatever was proposed before it lies in what the learner did not know of.
        assert occupancy[start] == 0
        assert all(occupancy[cell] != 0 for cell in cells[:rank])


def test_every_trial_drives_on_the_curious_field(spread):
    n_special = 0
    for episode, (curious, plain, _), _, _ in fold(spread[0]):
        if episode.kind is EpisodeKind.TRIAL:
            bag = BagReader(episode.bag)
            recorded = bag.messages(find_topic(bag.topics, 'control_field', {}))
            assert struct_from_cdr(POINT_CLOUD, recorded[0])['data'].tobytes() == curious
            n_special += curious != plain
    assert n_special > 0


def test_no_trial_collides(spread):
    outcomes = [learnt_bag.read.status.outcome for episode, _, learnt_bag, _ in fold(spread[0])
                if episode.kind is EpisodeKind.TRIAL]
    assert len(outcomes) == N_TRIALS
    assert Outcome.COLLISION not in outcomes


def test_a_start_in_an_obstacle_gives_way_to_the_next(ros_domain, tmp_path):
    world = load_world(find_world('task1'))
    rows, cols = np.nonzero(world.occupancy)
    inside = world.grid.world_from_cell(int(rows[0]), int(cols[0]))
    free = world.grid.world_from_cell(3, 3)
    poses = [*inside, 0.0, *free, 0.0]
    with running_suite(tmp_path / 'suite', ros_domain, start_poses=poses,
                       auto_trials=1) as suite:
        suite.demonstrate()
        suite.node.ask('learner_node/run_trials')
        suite.wait_for_revision(2)
    *_, (_, _, learnt_bag, _) = fold(suite.task)
    first = learnt_bag.read.record.decisions[0]
    assert (first['row'], first['col']) == (3, 3)
