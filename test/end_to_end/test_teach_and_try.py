"""The whole loop on three real processes: teach, try, learn; the field is that of the bags."""

import time

import pytest

from control_field.grid import Grid
from control_field.local_grid import UNKNOWN
from control_field.records import Outcome
from control_field.windows import moved
from episode_store.episode import Episode
from episode_store.relearn import Relearner
from episode_store.task_folder import EpisodeKind
from experience_cli.commands.learn import field_bytes
from experience_cli.errors import UserError
from experience_cli.main import main
from msgs_bridge.messages.tables import field_from_cloud
from suite_helpers import relearnt, running_suite

pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def taught(ros_domain, tmp_path_factory):
    """Run the loop twice; yield folder, live bytes and how long each refresh took."""
    runs = []
    for name in ('first', 'second'):
        with running_suite(tmp_path_factory.mktemp(name) / 'suite', ros_domain) as suite:
            said = suite.demonstrate()
            suite.node.ask('learner_node/run_trials')
            suite.wait_for_revision(3)
            suite.wait(lambda: suite.newest_revision() == 3, 'the last field')
            runs.append((suite.task, suite.live_bytes(), said, list(suite.fields)))
    return runs


def test_what_the_learner_published_is_what_the_bags_teach(taught):
    for task, live, _, _ in taught:
        assert field_bytes(relearnt(task).field()) == live


def test_the_same_run_twice_gives_the_same_bytes(taught):
    (_, first, _, fields), (_, second, _, again) = taught
    assert first == second
    # On a busy machine the next field may come before the last one was heard.
    fields, again = ({field_from_cloud(cloud).revision: bytes(cloud.data) for cloud in clouds}
                     for clouds in (fields, again))
    heard = fields.keys() & again.keys()
    assert 3 in heard
    assert {revision: fields[revision] for revision in heard} == {
        revision: again[revision] for revision in heard}


def test_it_learns_the_task(taught):
    for task, _, said, _ in taught:
        header = Episode.at(task.episodes()[0].path).header
        relearner = Relearner.for_header(header)
        learnt_bags = [relearner.learn(Episode(episode)) for episode in task.episodes()]
        kinds = [learnt_bag.folder.kind for learnt_bag in learnt_bags]
        assert kinds == [EpisodeKind.DEMO, EpisodeKind.TRIAL, EpisodeKind.TRIAL]
        # An answer that is lost is empty: what counts is what the learner does.
        assert not said or '0001' in said
        demo, *trials = learnt_bags
        end = header.grid.world_from_cell(*demo.content.record.cells[-1].tolist())
        assert end == (3.875, 4.125)
        assert [trial.content.record.outcome for trial in trials] == [Outcome.GOAL] * 2
        assert trials[0].refresh.reinforcements > 0
        assert trials[1].refresh.reinforcements == 0


def test_experience_learn_agrees_with_every_recorded_field(taught, capsys):
    task = taught[0][0]
    assert main(['learn', '--check', str(task.path)]) == 0
    said = capsys.readouterr().out
    assert 'control_field revision 3 sha256' in said
    assert len(said.splitlines()) == 4


def test_a_restarted_learner_publishes_the_same_field(taught, ros_domain, tmp_path):
    task, live, _, _ = taught[0]
    with running_suite(tmp_path / 'again', ros_domain, bags=str(task.root)) as suite:
        assert suite.live_bytes() == live


def test_without_its_demonstration_no_trial_starts(ros_domain, tmp_path):
    with running_suite(tmp_path / 'dropped', ros_domain) as suite:
        suite.demonstrate()
        suite.wait(lambda: suite.node.status.revision == 1, 'the field in force')
        suite.node.ask('learner_node/drop_last')
        suite.wait(lambda: suite.node.status.revision == 0, 'the void field in force')
        for service in ('control_field_node/start_trial', 'learner_node/run_trials'):
            with pytest.raises(UserError, match=r'no control field|nothing was learnt'):
                suite.node.ask(service)
        # The revision of before comes again, with what is shown now.
        suite.node.set_parameter('sim_node', 'world', 'open')
        suite.node.ask('sim_node/reset')
        suite.wait(lambda: suite.node.odometry.pose.pose.position.y < 1.0, 'the robot set back')
        suite.demonstrate()
        suite.wait(lambda: suite.node.status.revision == 1, 'the next field in force')
        suite.node.ask('learner_node/run_trials')
        suite.wait_for_revision(3)


# It measures time, so the machine has to be free; on any machine the share of it that is ours:
# test_task_memory.py.
@pytest.mark.long
def test_learning_and_pushing_take_less_than_a_fifth_of_a_second(ros_domain, tmp_path):
    ended, pushed = {}, {}
    with running_suite(tmp_path / 'timed', ros_domain, auto_trials=3) as suite:
        suite.demonstrate()
        suite.node.ask('learner_node/run_trials')

        def is_over():
            status = suite.node.status
            if status is not None and status.outcome is not None:
                ended.setdefault(status.trial, time.monotonic())
            if suite.fields:
                pushed.setdefault(field_from_cloud(suite.fields[-1]).revision - 1,
                                  time.monotonic())
            return 3 in pushed

        suite.wait(is_over, 'three trials')
        suite.wait_for_revision(4)
    assert min(pushed[trial] - ended[trial] for trial in ended) < 0.2


def test_with_a_wide_local_grid_all_that_is_seen_is_recorded_and_learnt(
        ros_domain, tmp_path, capsys):
    with running_suite(tmp_path / 'wide', ros_domain) as suite:
        suite.wait(lambda: _sees(suite, 15), 'a simulator that sees farther')
        suite.demonstrate()
        suite.node.ask('learner_node/run_trials')
        suite.wait_for_revision(3)
        suite.wait(lambda: suite.newest_revision() == 3, 'the last field')
        live, task = suite.live_bytes(), suite.task
    field = relearnt(task).field()
    assert field_bytes(field) == live
    shown = [Episode.at(folder.path).content.record.local_grids for folder in task.episodes()]
    assert [each['cells'].shape[1:] for each in shown] == [(15, 15)] * 3
    known = moved(field.known, field.grid, Grid(20, 20, 0.25), UNKNOWN)  # of the world
    assert (known >= 0).mean() > 0.7  # a third of that by 3 x 3
    assert (known > 0).sum() == 5  # all of the wall
    assert main(['learn', '--check', str(task.path)]) == 0
    assert main(['explain', str(task.episodes()[1].path), '--at', '1']) == 0
    assert main(['inspect', str(task.episodes()[1].path)]) == 0
    assert 'refused' not in capsys.readouterr().out


def _sees(suite, n):
    try:
        suite.node.set_parameter('sim_node', 'sight_cells', n)
    except UserError:
        return False
    return True
