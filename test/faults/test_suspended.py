"""
Each node stands still for a while in the middle of a trial, as under a closed lid: SIGSTOP.

The middleware takes who is silent for 20 s for gone. A standstill of 30 s is in the long suite
(`-m long`); a middleware that is told to wait for no more than 4 s does the same in 7 s.
"""

from contextlib import contextmanager, ExitStack
import signal
import time

import pytest
from std_msgs.msg import Bool

from bridge_helpers import content_of
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.gaps import KEY
from episode_store.task_folder import EpisodeKind
from episode_store.undo import take_away
from experience_cli.commands.learn import field_bytes
from msgs_bridge.node import qos
import ros_helpers
from sample_helpers import sample_copy
import suite_helpers
from suite_helpers import relearnt, running_suite, Suite
from terminal_helpers import TerminalProcess

pytestmark = pytest.mark.slow
LONG = [pytest.mark.long, pytest.mark.timeout(900)]
#: A base that stops by itself before the robot gets where its last command was not meant for.
BASE = {'cmd_vel_timeout': 0.5}
#: The simulated robot's local grid is a costmap here, which `neighbourhood_node` reads.
SIM = {**BASE, 'world': 'task1', 'lockstep': False, 'rate': 10.0, 'speed_factor': 3.0}
#: Fast DDS takes participants for gone so soon.
IMPATIENT = """<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com">
  <participant profile_name="impatient" is_default_profile="true">
    <rtps><builtin><discovery_config>
      <leaseDuration><sec>4</sec></leaseDuration>
      <leaseAnnouncement><sec>0</sec><nanosec>500000000</nanosec></leaseAnnouncement>
    </discovery_config></builtin></rtps>
  </participant>
</profiles>
"""
#: How long the middleware waits usually, [s].
LEASE = 20.0
NODES = ('sim_node', 'control_field_node', 'learner_node', 'neighbourhood_node', 'teleop_node')


class RealTimeSuite(Suite):
    """All nodes in real time, with a teleop that watches; the way was shown before."""

    def __init__(self, folder, domain, stack):
        task = sample_copy(folder)
        take_away(task, [2, 3])
        super().__init__(folder, domain, stack, task=task.task, auto_start=True, auto_trials=1)
        self.task = task
        self.contacts = []
        self.node._node.create_subscription(
            Bool, 'contact', lambda msg: self.contacts.append(msg.data), qos.LATCHED)

    def start_all(self):
        """Start the five nodes."""
        self._start('sim_node', SIM, {'neighbourhood': 'costmap'})
        self._start('neighbourhood_node', {'source': 'costmap', 'use_sim_time': True}, {},
                    'neighbourhood_node.node')
        command = ros_helpers.node_command('teleop_node.node', self.folder, {
            'enable_stamped_cmd_vel': True})
        self.teleop = self._stack.enter_context(TerminalProcess(
            command, self.folder, env=self._options['env'], name='teleop_node'))
        self.processes['teleop_node'] = self.teleop
        self.start('control_field_node', **BASE, lockstep=False, heartbeat=True,
                   use_sim_time=True)
        self.start('learner_node', lockstep=False, use_sim_time=True)

    def _start(self, name, parameters, remappings, module=None):
        self.processes[name] = self._stack.enter_context(ros_helpers.start_node(
            module or f'{name}.node', self.folder,
            {'enable_stamped_cmd_vel': True, **parameters}, remappings=remappings,
            **self._options))

    def wait(self, predicate, what, patience=suite_helpers.DEADLINE):
        """Wait; what teleop shows is taken in meanwhile, it would stand still otherwise."""
        return super().wait(lambda: (self.teleop.read(), predicate())[1], what, patience)

    def report(self):
        """Return what the nodes said; teleop's line comes ten times a second."""
        return '\n'.join(process.report() for process in self.processes.values()
                         if process is not self.teleop)

    def is_idle(self):
        """Tell whether no trial is run or asked for."""
        learner = self.node.learner
        return learner.get('phase') == 'idle' and learner['trials_left'] == '0'

    def in_trial(self):
        """Wait for the middle of a trial; let one run whenever none is run or asked for."""
        self.node.status = None

        def is_under_way():
            if self.is_idle():
                self.node.learner = {}
                self.node.ask('learner_node/run_trials')
            return self.has_come_to_step(2)

        self.node.learner = {}
        self.wait(is_under_way, 'the middle of a trial')

    def suspend(self, name, seconds):
        """Let a node stand still."""
        self.processes[name].send(signal.SIGSTOP)
        until = time.monotonic() + seconds
        self.wait(lambda: time.monotonic() > until, 'the end of the sleep')
        self.processes[name].send(signal.SIGCONT)


@contextmanager
def real_time_suite(folder, domain):
    with ExitStack() as stack:
        suite = RealTimeSuite(folder, domain, stack)
        suite.start_all()
        yield suite


def check_bags(suite):
    """Every bag is whole or called incomplete, and teaches what was learnt live."""
    outcomes = []
    for episode in suite.task.episodes():
        said = KEY in (episode.path / 'metadata.yaml').read_text()
        assert said == bool(gaps := Episode.at(episode.path).gaps), (episode.name, str(gaps))
        if episode.kind is EpisodeKind.TRIAL:
            outcomes.append(content_of(episode.path).record.outcome)
    report = '\n'.join([str(outcomes), suite.report()])
    assert Outcome.COLLISION not in outcomes, report
    assert outcomes[-1] is Outcome.GOAL, report
    assert field_bytes(relearnt(suite.task).field()) == suite.live_bytes(), report
    for process in suite.processes.values():
        assert 'Traceback' not in process.stdout + process.stderr, report
    return outcomes


@pytest.mark.parametrize('pauses', [
    pytest.param((0.3, 2.0), id='short'), pytest.param((30.0,), id='30 s', marks=LONG)])
def test_a_robot_touches_nothing_and_reaches_the_goal_whatever_node_stands_still(
    ros_domain, tmp_path, pauses,
):
    with real_time_suite(tmp_path, ros_domain) as suite:
        for name in NODES:
            suite.in_trial()
            for seconds in pauses:
                suite.suspend(name, seconds)
            if max(pauses) > LEASE:
                # The middleware may not get over a second one before all have met again.
                suite.wait(suite.is_idle, f'the end of a trial after that of {name}', 300.0)
        suite.in_trial()
        suite.wait(suite.is_idle, 'the last trials')
        outcomes = check_bags(suite)
        assert set(outcomes) <= {Outcome.GOAL, Outcome.ABORTED, Outcome.STOPPED}, suite.report()
        assert not any(suite.contacts), suite.report()


@pytest.mark.parametrize(('seconds', 'profiles'), [
    pytest.param(7.0, IMPATIENT, id='7 s'), pytest.param(30.0, '', id='30 s', marks=LONG)])
def test_a_trial_whose_recorder_sleeps_until_it_is_forgotten_counts(
    ros_domain, tmp_path, seconds, profiles,
):
    env = {'FASTRTPS_DEFAULT_PROFILES_FILE': str(tmp_path / 'profiles.xml')} if profiles else {}
    (tmp_path / 'profiles.xml').write_text(profiles)
    with running_suite(tmp_path / 'suite', ros_domain, env=env, auto_start=True) as suite:
        suite.demonstrate()
        suite.wait_for_step(3)
        learner = suite.processes['learner_node']
        learner.send(signal.SIGSTOP)
        until = time.monotonic() + seconds
        suite.wait(lambda: time.monotonic() > until, 'the end of the sleep')
        assert not suite.node._node.count_publishers('/control_field')
        learner.send(signal.SIGCONT)
        suite.wait_for_revision(3)
        suite.wait(lambda: suite.newest_revision() == 3, 'the last field')
        assert check_bags(suite) == [Outcome.GOAL, Outcome.GOAL], suite.report()
        assert 'no odometry' not in learner.stdout + learner.stderr, suite.report()
        for episode in suite.task.episodes():
            # No decision is missing. What comes ten times a second may be until the middleware has
            # brought all together again, which takes a busy machine its time; the bag says so.
            gaps = Episode.at(episode.path).gaps
            assert not gaps.n_missing, gaps
            assert not gaps.holes or episode.kind is EpisodeKind.TRIAL, gaps
            assert {*gaps.lost} <= {'/trial'}, gaps
