"""A person at the keys: drive, redo, keep, watch it try; four real processes and a terminal."""

from contextlib import ExitStack
import math
import re
import time

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from episode_store.label import read_label
from msgs_bridge.messages.poses import pose_from_odometry
from msgs_bridge.messages.trial_status import Label, State, trial_from_status
from msgs_bridge.node import qos
import ros_helpers
from terminal_helpers import TerminalProcess

START = (0.625, 0.875)
N_TRIALS = 2
#: A tick is 50 ms of simulated time; either way a second of driving takes a fifth of a second.
LOCKSTEP = {'lockstep': True}
REAL_TIME = {'speed_factor': 5.0}


#: What the screen says when a key has done what it is for.
ANSWERS = {
    'start demonstration': 'ecording drive/', 'redo': 'ecording drive/', 'keep': 'kept: ',
    'run trials': 'he robot tries', 'label failure': 'is labelled failure',
    'label success': 'is labelled success', 'drop last': 'is dropped', 'undo': 'is back',
    'set back': 'he robot stands at', 'teach here': 'helps most', 'stop': '.',
    'cancel': 'is thrown away'}


class Person:
    """Looks at the robot and at the screen, and types."""

    def __init__(self, node, folder, pace, simulation=True):
        self.node, self.folder = node, folder
        self.statuses, self.pose = [], None
        self.stack = ExitStack()
        self.lockstep = {'lockstep': pace.get('lockstep', False)}
        node.create_subscription(Odometry, 'odom', self._look, qos.SENSOR)
        node.create_subscription(DiagnosticStatus, 'trial', self._hear, qos.RECORDING_LATCHED)
        self.others = [self.start('sim_node', pace), self.start('control_field_node', {}),
                       self.start('learner_node', {
                           'task': 'drive', 'bags': str(folder / 'bags'), 'simulation': simulation,
                           'auto_trials': N_TRIALS})]
        command = ros_helpers.node_command('teleop_node.node', folder, {
            **self.lockstep, 'rate': 100.0 if self.lockstep['lockstep'] else 20.0, 'turn': 0.8})
        self.terminal = self.stack.enter_context(TerminalProcess(command, folder, width=120))

    def start(self, name, parameters):
        return self.stack.enter_context(ros_helpers.start_node(
            f'{name}.node', self.folder, {**self.lockstep, **parameters}))

    def _look(self, msg):
        self.pose = pose_from_odometry(msg)

    def _hear(self, msg):
        self.statuses.append(trial_from_status(msg))

    def wait(self, predicate, what, deadline=60.0):
        return ros_helpers.wait_until(
            predicate, deadline, node=self.node, processes=[*self.others, self.terminal],
            what=what)

    def types(self, key, answer):
        """Type a key of an action, again if it is too early, until the screen says it is done."""
        said, deadline = len(self.terminal.read()), 0.0

        def is_done():
            nonlocal deadline
            text = self.terminal.read()[said:]
            if time.monotonic() > deadline and text.count('Not done') == self.presses:
                deadline = time.monotonic() + 1.0  # what comes sooner is a key that is held
                self.presses += 1
                self.terminal.type(key)
            return any(ANSWERS[answer] in line for line in text.splitlines() if (
                'Not done' not in line))
        self.presses = 0
        self.wait(is_done, answer)

    def holds(self, key, until, what, stop=True):
        """Hold a key until the robot is where it should be."""
        def there():
            self.terminal.type(key)
            return until(self.pose)
        self.wait(there, what)
        if stop:
            self.terminal.type('k')
        self.wait(lambda: abs(self.pose.v) + abs(self.pose.w) < 1e-6, 'the standstill')

    def asks(self, action):
        """Call the service of an action; return its answer."""
        return ros_helpers.call(self.node, Trigger, f'teleop_node/{action}')

    def leaves(self):
        """Ask to quit; return the exit code. Who is gone may not have been heard answering."""
        client = self.node.create_client(Trigger, 'teleop_node/quit')
        self.wait(client.service_is_ready, 'the service')
        future = client.call_async(Trigger.Request())
        ros_helpers.wait_until(lambda: not self.terminal.running, node=self.node,
                               processes=self.others, what='the end')
        assert not future.done() or future.result().success
        return self.terminal.popen.returncode

    def slows_time(self, factor):
        """Let the simulator go slower, so that a busy machine's person has time to act."""
        request = SetParameters.Request(
            parameters=[Parameter('speed_factor', value=factor).to_parameter_msg()])
        assert ros_helpers.call(
            self.node, SetParameters, 'sim_node/set_parameters', request).results[0].successful

    def is_at(self, x, y, tolerance=0.05):
        return self.pose is not None and math.hypot(
            self.pose.x - x, self.pose.y - y) < tolerance

    def episodes(self):
        folder = self.folder / 'bags' / 'drive'
        return sorted(path.name for path in folder.iterdir() if path.name[:4].isdigit())

    def ended(self):
        """Return the trials that have ended, by number."""
        return {status.trial: status for status in self.statuses if status.state is State.ENDED}


@pytest.fixture(params=[LOCKSTEP, REAL_TIME], ids=['lockstep', 'real_time'])
def person(request, ros_node, tmp_path):
    someone = Person(ros_node, tmp_path, request.param)
    with someone.stack:
        someone.wait(lambda: 'ready' in someone.terminal.read(), 'the learner')
        someone.wait(lambda: someone.pose is not None and someone.statuses, 'the others')
        yield someone


#: In lock-step a trial is over before a person can do anything about it.
only_real_time = pytest.mark.parametrize('person', [REAL_TIME], ids=['real_time'], indirect=True)


@pytest.mark.slow
def test_teach_redo_keep_try_label_drop(person):
    person.types('s', 'start demonstration')
    person.wait(lambda: 'RECORDING' in person.terminal.read(), 'the status line')
    person.holds('i', lambda pose: pose.x > 1.2, 'the wrong way')
    person.types('r', 'redo')
    person.wait(lambda: person.is_at(*START), 'the robot set back')
    assert person.episodes() == ['0002_demo']

    person.holds('i', lambda pose: pose.x > 2.55, 'the turn')
    person.holds('j', lambda pose: pose.yaw > 1.45, 'the other direction')
    person.holds('i', lambda pose: pose.y > 2.3, 'the goal')
    person.types('n', 'keep')
    goal = person.pose.x, person.pose.y
    person.wait(lambda: re.search(
        r'goal reached from \d+ % of the places seen', person.terminal.read()), 'the certificate')

    person.types('t', 'run trials')
    person.wait(lambda: len(person.ended()) == N_TRIALS, 'the trials')
    assert {str(status.outcome) for status in person.ended().values()} == {'goal'}
    assert person.is_at(*goal, 0.25)
    person.wait(lambda: f'trial {N_TRIALS} goal' in person.terminal.read(), 'the status line')
    person.wait(lambda: len(person.episodes()) == 1 + N_TRIALS, 'the bags')
    assert person.episodes()[1:] == ['0003_trial', '0004_trial']
    person.wait(lambda: f'trial {N_TRIALS} goal, ' in person.terminal.read() and (
        '(drive/0004)' in person.terminal.lines()[-1]), 'the bag of the trial')

    person.types('f', 'label failure')
    assert read_label(person.folder / 'bags/drive/0004_trial') is Label.FAILURE
    person.types('y', 'label success')
    assert read_label(person.folder / 'bags/drive/0004_trial') is Label.SUCCESS
    person.types('d', 'drop last')
    assert person.episodes() == ['0002_demo', '0003_trial']
    person.types('b', 'undo')
    assert person.episodes() == ['0002_demo', '0003_trial', '0004_trial']
    # The recorder asks for more than is published, and then for less: nobody has to know.
    assert not any('incompatible QoS' in process.stderr for process in person.others)

    person.types('g', 'set back')
    person.wait(lambda: person.is_at(*START), 'the robot at the start')
    person.types('h', 'teach here')
    person.wait(lambda: not person.is_at(*START), 'the robot elsewhere')

    person.terminal.type('\x1b')
    assert person.terminal.wait() == 0
    assert person.terminal.mode() == person.terminal.before


@only_real_time
@pytest.mark.slow
def test_every_action_is_a_service_that_answers_and_keeps_no_key_waiting(person):
    # That the learner hears the robot, too, may take longer.
    person.wait(lambda: person.asks('start_demonstration').success, 'the recording')
    person.holds('i', lambda pose: pose.x > 1.2, 'the wrong way')
    assert person.asks('redo').success
    person.wait(lambda: person.is_at(*START), 'the robot set back')
    person.holds('i', lambda pose: pose.x > 2.6, 'the goal')
    assert 'gets to the goal' in person.asks('keep').message
    assert person.asks('run_trials').success
    person.wait(lambda: len(person.ended()) == N_TRIALS, 'the trials')
    person.wait(lambda: len(person.episodes()) == 1 + N_TRIALS, 'the bags')
    person.wait(lambda: 'ready' in person.terminal.lines()[-1], 'the learner')
    for action, label in (('label_failure', Label.FAILURE), ('label_success', Label.SUCCESS)):
        assert person.asks(action).success
        assert read_label(person.folder / 'bags/drive/0004_trial') is label
    assert person.asks('drop_last').success
    assert person.episodes() == ['0002_demo', '0003_trial']
    assert person.asks('stop').success
    assert not person.asks('keep').success
    person.holds('l', lambda pose: pose.yaw < -0.5, 'a turn')
    assert person.leaves() == 0


@only_real_time
@pytest.mark.slow
def test_space_ends_a_trial_and_no_more_are_run(person):
    person.types('s', 'start demonstration')
    person.holds('i', lambda pose: pose.x > 3.6, 'the goal')
    person.types('n', 'keep')
    person.slows_time(1.0)
    person.types('t', 'run trials')
    person.wait(lambda: person.statuses[-1].state is State.RUNNING and person.pose.x > 0.8,
                'a trial')
    person.wait(lambda: re.search('trial 1 running', person.terminal.lines()[-1]), 'the line')
    person.types(' ', 'stop')
    person.wait(lambda: 1 in person.ended(), 'the end of the trial')
    assert str(person.ended()[1].outcome) == 'stopped'
    person.wait(lambda: 'ready' in person.terminal.lines()[-1], 'the learner')
    assert len(person.ended()) == 1
    assert not person.is_at(3.6, START[1], 0.2)


@only_real_time
def test_who_drives_against_a_wall_reads_why_nothing_moves(person):
    person.holds('l', lambda pose: pose.yaw < -0.8, 'the wall ahead')
    # Five times as fast, a machine that halts for 20 ms lets the robot go on for 2 cm.
    person.slows_time(0.5)
    person.holds('i', lambda pose: 'HELD: blocked' in person.terminal.read(), 'the wall')
    person.wait(lambda: 'HELD' not in person.terminal.lines()[-1], 'the end of it')
    assert 'collision' not in person.others[0].stderr


@only_real_time
def test_who_does_not_drive_does_not_disturb_a_trial(person):
    person.types('s', 'start demonstration')
    person.holds('i', lambda pose: pose.x > 3.0, 'the goal')
    person.types('n', 'keep')
    person.types('t', 'run trials')
    person.wait(lambda: person.statuses[-1].state is State.RUNNING and person.pose.x > 0.8,
                'a trial')
    # More at once would be taken for pasted.
    for keys, refused in (('snradbyf', 'cannot change a bag now'), ('tghqzwxe', 'set the robot')):
        person.terminal.type(keys)
        person.wait(lambda said=refused: said in person.terminal.read(), refused)
    person.wait(lambda: 1 in person.ended(), 'the end of the trial')
    assert [status.state for status in person.statuses if status.trial == 1
            and status.state is State.PAUSED] == []
    assert str(person.ended()[1].outcome) == 'goal'
    person.types(' ', 'stop')


@only_real_time
@pytest.mark.slow
def test_a_person_takes_over_and_lets_go(person):
    person.types('s', 'start demonstration')
    person.holds('i', lambda pose: pose.x > 3.6, 'the goal')
    person.types('n', 'keep')
    person.slows_time(1.5)
    person.types('t', 'run trials')
    person.wait(lambda: person.statuses[-1].state is State.RUNNING and person.pose.x > 0.9,
                'a trial')
    person.holds('j', lambda pose: pose.yaw > 0.5, 'the turn that the person wants',
                 stop=False)
    assert any(status.state is State.PAUSED and 'person' in status.reason
               for status in person.statuses)
    person.wait(lambda: 1 in person.ended(), 'the end of the trial')
    assert str(person.ended()[1].outcome) == 'goal'
    person.types(' ', 'stop')


@pytest.mark.slow
@pytest.mark.parametrize('pace', [LOCKSTEP, REAL_TIME], ids=['lockstep', 'real_time'])
def test_what_a_trial_drives_is_not_learnt_as_a_persons_way(ros_node, tmp_path, pace):
    person = Person(ros_node, tmp_path, pace, simulation=False)
    with person.stack:
        person.wait(lambda: person.pose is not None and person.statuses, 'the others')
        person.types('s', 'start demonstration')
        person.holds('i', lambda pose: pose.x > 3.0, 'the goal')
        person.types('n', 'keep')
        assert ros_helpers.call(ros_node, Trigger, 'sim_node/reset').success
        person.wait(lambda: person.is_at(*START), 'the robot set back')

        person.types('s', 'start demonstration')
        person.wait(lambda: 'RECORDING' in person.terminal.lines()[-1], 'the status line')
        person.terminal.type('t')
        person.wait(lambda: 'Not done: cannot run a trial now: a drive is being '
                    'recorded; press n to keep it' in person.terminal.read(), 'the refusal')
        answer = ros_helpers.call(ros_node, Trigger, 'control_field_node/start_trial')
        assert not answer.success
        assert 'learner_node records a demonstration' in answer.message
        person.types('a', 'cancel')
        assert person.episodes() == ['0001_demo']
        person.types('s', 'start demonstration')
