"""A person at the keys, who looks at the robot and at the screen: four processes, a terminal."""

from contextlib import ExitStack
import math
import time

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from msgs_bridge.messages.poses import pose_from_odometry
from msgs_bridge.messages.trial_status import State, trial_from_status
from msgs_bridge.node import qos
import ros_helpers
from terminal_helpers import TerminalProcess

START = (0.625, 0.875)
N_TRIALS = 2
#: A tick is 50 ms of simulated time; either way a second of driving takes a fifth of a second. The
#: base waits for a command as long as the keyboard's ten a second need in this time.
LOCKSTEP = {'lockstep': True}
REAL_TIME = {'speed_factor': 5.0, 'cmd_vel_timeout': 1.0}


#: What the screen says when a key has done what it is for.
ANSWERS = {
    'start demonstration': 'ecording drive/', 'redo': 'ecording drive/', 'keep': 'kept: ',
    'run trials': 'he robot tries', 'label failure': 'is labelled failure',
    'label success': 'is labelled success', 'drop last': 'is dropped', 'undo': 'is back',
    'set back': 'he robot stands at', 'teach here': 'helps most', 'stop': '.',
    'cancel': 'is thrown away'}


class Person:
    """Looks at the robot and at the screen, and types."""

    def __init__(self, node, folder, pace, **learner):
        self.node, self.folder = node, folder
        self.statuses, self.pose = [], None
        self.stack = ExitStack()
        self.lockstep = {'lockstep': pace.get('lockstep', False)}
        node.create_subscription(Odometry, 'odom', self._look, qos.SENSOR)
        node.create_subscription(DiagnosticStatus, 'trial', self._hear, qos.RECORDING_LATCHED)
        self.others = [self.start('sim_node', pace), self.start('control_field_node', {}),
                       self.start('learner_node', {
                           'task': 'drive', 'bags': str(folder / 'bags'), 'simulation': True,
                           'auto_trials': N_TRIALS, **learner})]
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

    def forget(self):
        """Forget how the trials before have ended, and what the screen has shown."""
        self.statuses.clear()
        self.terminal.shown = ''
        self.wait(self.terminal.lines, 'the status line')

    def lets_it_try(self, x):
        """Let the robot try, until it is under way beyond a place; return the trial's number."""
        self.types('t', 'run trials')
        self.wait(lambda: self.statuses and self.statuses[-1].state is State.RUNNING and (
            self.pose.x > x), 'a trial')
        return self.statuses[-1].trial

    def is_at(self, x, y, tolerance=0.05):
        return self.pose is not None and math.hypot(
            self.pose.x - x, self.pose.y - y) < tolerance

    def episodes(self):
        folder = self.folder / 'bags' / 'drive'
        return sorted(path.name for path in folder.iterdir() if path.name[:4].isdigit())

    def ended(self):
        """Return the trials that have ended, by number."""
        return {status.trial: status for status in self.statuses if status.state is State.ENDED}
