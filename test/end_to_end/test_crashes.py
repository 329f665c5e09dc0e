"""Processes that die in the middle of a trial: the suite finishes by itself, no bag is lost."""

import pytest

from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.task_folder import EpisodeKind
from experience_cli.commands.learn import field_bytes
from suite_helpers import relearnt, running_suite

pytestmark = pytest.mark.slow


def outcomes(task):
    return [Episode.at(episode.path).content.record.outcome for episode in task.episodes()
            if episode.kind is EpisodeKind.TRIAL]


def finish(suite):
    suite.wait_for_revision(3)
    suite.wait(lambda: suite.newest_revision() == 3, 'the last field')
    assert field_bytes(relearnt(suite.task).field()) == suite.live_bytes()


@pytest.mark.parametrize('victim', ['learner_node', 'control_field_node', 'sim_node'])
def test_a_trial_that_was_broken_off_is_run_again(ros_domain, tmp_path, victim):
    with running_suite(tmp_path / 'suite', ros_domain, auto_start=True,
                       peer_timeout=1.0) as suite:
        suite.demonstrate()
        suite.wait_for_step(3)
        suite.kill(victim)
        suite.start(victim, **({'world': 'task1'} if victim == 'sim_node' else {}))
        finish(suite)
        learner = suite.processes['learner_node']
        found, report = learner.stdout + learner.stderr, suite.report()
    kinds = outcomes(suite.task)
    assert kinds.count(Outcome.ABORTED) == len(kinds) - 2 >= 1, report
    assert kinds.count(Outcome.GOAL) == 2, report
    if victim == 'learner_node':
        assert 'mended' in found
    else:
        assert 'broken off' in found
