"""Nothing drives on that nobody watches: a real teleop_node, real signals, a real controller."""

from contextlib import contextmanager
import shlex
import shutil
import signal
import time

from diagnostic_msgs.msg import DiagnosticStatus
import pytest
from std_srvs.srv import Trigger

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from controller_peer import controller, Peer
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus
from msgs_bridge.node import qos
import ros_helpers
from teleop_node.keys import ESCAPE
from terminal_helpers import TerminalProcess


class Trial:
    """A trial under way, as learner and controller tell of it; both end it when asked."""

    def __init__(self, node, answers=True):
        self.node, self.asked = node, []
        self.publisher = node.create_publisher(DiagnosticStatus, 'trial', qos.LATCHED)
        self.tell(State.RUNNING)
        if answers:
            node.create_service(Trigger, 'control_field_node/stop_trial', self._stop)
            node.create_service(Trigger, 'learner_node/stop_trials', self._stop_series)

    def tell(self, state, outcome=None):
        self.publisher.publish(status_from_trial(TrialStatus(state, 3, outcome, steps=5)))

    def _stop(self, _, response):
        self.asked.append('trial')
        self.tell(State.ENDED, Outcome.STOPPED)
        response.success, response.message = True, 'trial 3 was stopped after 5 steps'
        return response

    def _stop_series(self, _, response):
        self.asked.append('series')
        response.success, response.message = True, 'no more trials are run'
        return response

    def wait(self, predicate, processes=(), what='the end of the trial'):
        return ros_helpers.wait_until(
            predicate, node=self.node, processes=processes, what=what)

    def is_ended(self):
        return {*self.asked} == {'trial', 'series'}


@contextmanager
def teleop(trial, folder):
    command = ros_helpers.node_command('teleop_node.node', folder)
    with TerminalProcess(command, folder, name='teleop_node') as process:
        trial.wait(lambda: 'trial 3 running' in process.read() and trial.node.count_clients(
            'learner_node/stop_trials'), [process], 'the line')
        yield process


ENDS = {'escape': lambda process: process.type(ESCAPE), 'ctrl_c': lambda it: it.type('\x03'),
        'sigterm': lambda it: it.send(signal.SIGTERM), 'sighup': lambda it: it.send(signal.SIGHUP),
        'closed_window': lambda it: it.close()}


@pytest.mark.parametrize('end', ENDS)
def test_whoever_leaves_ends_the_trial_and_the_series_first(ros_node, tmp_path, end):
    trial = Trial(ros_node)
    with teleop(trial, tmp_path) as process:
        ENDS[end](process)
        trial.wait(lambda: not process.running)
        assert process.wait() == 0
        assert trial.is_ended()
        if end != 'closed_window':
            assert 'Trial 3 was stopped after 5 steps; no more trials are run.' in process.read()
            assert process.mode() == process.before


@pytest.mark.parametrize('again', [True, False])
def test_who_does_not_answer_is_waited_for_a_while_but_not_after_a_second_ctrl_c(
    ros_node, tmp_path, again,
):
    trial = Trial(ros_node)
    with teleop(trial, tmp_path) as process:  # from here on nobody spins this node
        began = time.monotonic()
        process.type('\x03')
        while again and time.monotonic() - began < 0.6:
            assert process.running
            time.sleep(0.01)
        if again:
            process.type('\x03')
        assert process.wait() == 0
        assert not trial.asked
        assert again == ('the trial may go on: control_field_node does not answer'
                         not in process.read())


@pytest.mark.skipif(shutil.which('bash') is None, reason='bash is not installed')
def test_ctrl_z_ends_the_trial_before_it_suspends(ros_node, tmp_path):
    trial = Trial(ros_node)
    command = ros_helpers.node_command('teleop_node.node', tmp_path)
    with TerminalProcess(['bash', '--norc', '--noediting', '-i'], tmp_path) as shell:
        usual = shell.before[3]
        shell.type(shlex.join(command) + '\n')
        trial.wait(lambda: 'trial 3 running' in shell.read(), [shell], 'the line')
        shell.type('\x1a')
        trial.wait(lambda: 'Stopped' in shell.report(), [shell], 'the shell')
        assert trial.is_ended()
        shell.type('fg\n')
        trial.wait(lambda: shell.mode()[3] != usual, [shell], 'the keys')
        shell.type(ESCAPE)
        trial.wait(lambda: shell.mode()[3] == usual, [shell], 'the end')
        shell.type('exit\n')
        assert shell.wait() == 0


@pytest.mark.parametrize('key', ['k', 'K', '\x1b[A', '5'])
def test_any_key_that_is_no_action_stops_and_the_trial_ends(ros_node, tmp_path, key):
    trial = Trial(ros_node)
    with teleop(trial, tmp_path) as process:
        process.type(key)
        trial.wait(trial.is_ended, [process])


@pytest.mark.parametrize('number', [signal.SIGKILL, signal.SIGSTOP])
def test_with_a_heartbeat_a_trial_ends_when_teleop_dies_or_hangs(ros_node, tmp_path, number):
    with controller(tmp_path, {'heartbeat': True, 'odom_timeout': 40.0,
                               'neighbourhood_timeout': 40.0}):
        peer = Peer(ros_node).meet().push()
        peer.wait(lambda: peer.tick() or 'nobody watches over the robot' in peer.call(
            'start_trial').message, 'the refusal')
        with ros_helpers.start_node(
                'teleop_node.node', tmp_path, {'keyboard': False}) as teleop_node:
            peer.start()
            later = time.monotonic() + 1.5  # more than the timeout
            peer.wait(lambda: time.monotonic() > later, 'a while')
            assert peer.status.state is State.RUNNING
            teleop_node.send(number)
            peer.wait(lambda: peer.status.state is State.ENDED, 'the end')
            assert peer.status.stop_reason is StopReason.NO_HEARTBEAT
            assert peer.status.outcome is Outcome.STOPPED
            peer.wait(lambda: peer.commands and peer.has_stopped(), 'a standstill')
            teleop_node.kill()
