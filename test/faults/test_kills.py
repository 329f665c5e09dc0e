"""Twenty kill -9 in the middle of trials: the suite finishes by itself and keeps every bag."""

import random

import pytest
from rosbags.highlevel import AnyReader

from bridge_helpers import content_of
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.repair import repair_task
from episode_store.task_folder import EpisodeKind
from experience_cli.commands.learn import field_bytes
from msgs_bridge.messages.tables import field_from_cloud
from suite_helpers import PARAMETERS, relearnt, running_suite

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]
N_TRIALS = 8
#: Ticks a second: more of them make a trial, and so its middle, longer.
RATE = 20.0
#: Each node five times, and all of them five times, in an order that the seed makes.
VICTIMS = 5 * [*((name,) for name in PARAMETERS), tuple(PARAMETERS)]


def break_off(suite, rng, victims):
    """Kill nodes at a random step of a running trial, start them again; return the bags then."""
    suite.node.status = None
    suite.wait_for_step(rng.randint(1, 12))
    for name in victims:
        suite.kill(name)
    bags = {episode.name for episode in suite.task.episodes()}
    for name in victims:
        suite.start(name, **({'world': 'task1', 'rate': RATE} if name == 'sim_node' else {}))
    return bags


def n_messages(path):
    with AnyReader([path]) as bag:
        return sum(1 for _ in bag.messages())


def revisions_in(path):
    """Return the field revisions that the controller said it drove on, as others read them."""
    with AnyReader([path]) as bag:
        statuses = [bag.deserialize(raw, connection.msgtype)
                    for connection, _, raw in bag.messages() if connection.topic == '/trial']
    values = [{pair.key: pair.value for pair in status.values} for status in statuses]
    return {int(value['revision']) for value in values if value['state'] == 'running'}


def trials(task):
    return [content_of(episode.path).record for episode in task.episodes()
            if episode.kind is EpisodeKind.TRIAL]


@pytest.fixture(scope='module')
def killed(ros_domain, tmp_path_factory):
    """
    Kill twenty times; return the task, the live field, and the bags that there were.

    That all trials reached the goal in the end is checked here, where a second chance begins anew.
    """
    rng = random.Random(5)
    victims = rng.sample(VICTIMS, len(VICTIMS))
    bags: set[str] = set()
    with running_suite(tmp_path_factory.mktemp('killed') / 'suite', ros_domain, auto_start=True,
                       auto_trials=N_TRIALS, peer_timeout=1.0) as suite:
        suite.demonstrate()
        for names in victims:
            bags |= break_off(suite, rng, names)
        suite.wait_for_revision(N_TRIALS + 1)
        suite.wait(lambda: suite.fields and field_from_cloud(suite.fields[-1]).revision
                   == N_TRIALS + 1, 'the last field')
        live = suite.live_bytes()
        report = suite.report()
    outcomes = [trial.outcome for trial in trials(suite.task)]
    assert outcomes.count(Outcome.GOAL) == N_TRIALS, report
    assert outcomes.count(Outcome.ABORTED) == len(outcomes) - N_TRIALS, report
    return suite.task, live, bags


def test_the_suite_finishes_its_trials_by_itself(killed):
    assert len(trials(killed[0])) > len(VICTIMS) / 2  # it was in the middle of trials


def test_no_bag_is_lost_and_all_are_readable_by_others(killed):
    task, _, bags = killed
    assert repair_task(task) == []  # the learner has mended them
    names = {episode.name for episode in task.episodes()}
    assert bags <= names
    assert [episode.number for episode in task.episodes()] == list(range(1, len(names) + 1))
    assert all(n_messages(episode.path) > 0 for episode in task.episodes())


def test_the_field_is_as_if_the_broken_trials_had_been_marked_aborted(killed):
    task, live, _ = killed
    relearner = relearnt(task)
    assert field_bytes(relearner.field()) == live
    assert relearner.n_trials == N_TRIALS
    unbroken = Relearner(None, relearner.parameters, fitted=True)
    for episode in task.episodes():
        read = content_of(episode.path)
        if getattr(read.record, 'outcome', None) is not Outcome.ABORTED:
            unbroken.learn(Episode(episode))
    assert field_bytes(unbroken.field()) == live


def test_every_bag_shows_the_revision_that_was_driven_on(killed):
    revision = 1
    for episode in killed[0].episodes()[1:]:
        outcome = content_of(episode.path).record.outcome
        assert revisions_in(episode.path) <= {revision}
        if outcome is not Outcome.ABORTED:
            assert revisions_in(episode.path) == {revision}
            revision += 1
