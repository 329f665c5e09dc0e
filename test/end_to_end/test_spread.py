"""Trials from starts that the learner chooses, on the real nodes in lock-step."""

from typing import NamedTuple

import numpy as np
import pytest

from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.relearn import LearntBag, Relearner
from episode_store.task_folder import EpisodeFolder, EpisodeKind
from experience_cli.commands.learn import field_bytes
from msgs_bridge.messages.cdr import POINT_CLOUD, struct_from_cdr
from suite_helpers import relearnt, running_suite
from world_maps.world import find_world, load_world

pytestmark = pytest.mark.slow
N_TRIALS = 6


class Step(NamedTuple):
    """A bag that was learnt from, and what there was before it."""

    episode: EpisodeFolder
    exploring: bytes
    plain: bytes
    starts: list[tuple[int, int]]
    learnt: LearntBag


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
    """Learn the bags anew; yield each, with the fields and the starts that there were before."""
    header = Episode.at(task.episodes()[0].path).header
    relearner = Relearner.for_header(header)
    for episode in task.episodes():
        fields, starts = (b'', b''), []
        if relearner.refresh:
            fields = field_bytes(relearner.field(exploring=True)), field_bytes(relearner.field())
            starts = [relearner.promising_start(rank) for rank in range(400)]
        cells = [relearner.grid.cell_from_world(start.x, start.y) for start in starts]
        yield Step(episode, *fields, cells, relearner.learn(Episode(episode)))


@pytest.fixture(scope='module')
def steps(spread):
    return list(fold(spread[0]))


@pytest.fixture
def trials(steps):
    return [step for step in steps if step.episode.kind is EpisodeKind.TRIAL]


def test_live_and_relearnt_field_are_the_same_bytes(spread):
    task, live = spread
    assert field_bytes(relearnt(task).field()) == live


def test_the_known_share_of_the_workspace_grows(steps):
    known = [float((step.learnt.refresh.field.known != -1).mean()) for step in steps]
    assert known == sorted(known)
    assert known[-1] > known[0] + 0.1


def test_every_start_is_the_best_one_that_is_free(trials):
    occupancy = load_world(find_world('task1')).occupancy
    for step in trials:
        first = step.learnt.content.record.decisions[0]
        start = int(first['row']), int(first['col'])
        rank = step.starts.index(start)
        # Whatever was proposed before it lies in what the learner did not know of.
        assert occupancy[start] == 0
        assert all(occupancy[cell] != 0 for cell in step.starts[:rank])


def test_every_trial_drives_on_the_curious_field(trials):
    for step in trials:
        recorded = Episode(step.episode).messages('control_field')
        assert struct_from_cdr(POINT_CLOUD, recorded[0])['data'].tobytes() == step.exploring
    assert any(step.exploring != step.plain for step in trials)


def test_no_trial_collides(trials):
    outcomes = [step.learnt.content.status.outcome for step in trials]
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
    trial = Episode.at(suite.task.find(2).path)
    first = trial.content.record.decisions[0]
    assert trial.header.grid.world_from_cell(int(first['row']), int(first['col'])) == free
