"""Ctrl-C is one line and code 130, or nothing and 0 of a node, however early it comes."""

import os
import shutil
import signal
import sys

import pytest

from experience_cli.interrupts import stoppable
from experience_cli.quiet_start import ours
from ros_helpers import child_environment, Process, ROOT, wait_until

EVALUATE = ['evaluate', '--world', 'task1', '--goal', '3.9,4.1', '--demo-start', '0.6,0.9']


def early_python(folder):
    """Return an environment in which Python imports the quiet start first, as in our .venv."""
    shutil.copy(ROOT / 'experience_cli/quiet_start.py', folder / 'sitecustomize.py')
    return child_environment({'PYTHONPATH': f'{folder}{os.pathsep}{ROOT}'})


def interrupted(command, folder, word, number=signal.SIGINT, **more):
    """Start a command that tells what it imports, and interrupt it at a word of that."""
    with Process([sys.executable, '-X', 'importtime', *command], folder, **more) as process:
        wait_until(lambda: word in process.stderr, processes=[process], what=word)
        process.send(number)
        code = process.popen.wait(20)
    said = [line for line in process.stderr.splitlines() if not line.startswith('import time:')]
    return code, said


@pytest.mark.parametrize('word', ['sitecustomize', ' numpy', 'llvmlite'])
def test_a_command_says_one_line_wherever_it_is(tmp_path, word):
    code, said = interrupted(['-m', 'experience_cli.main', *EVALUATE], tmp_path, word,
                             env=early_python(tmp_path))
    assert (code, said) == (130, ['experience evaluate: stopped'])


def test_a_signal_that_waits_is_heard_at_the_start(tmp_path):
    # As it is between two interpreters, one of which starts the other.
    code = ('import os, signal, sys; '
            'signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT]); '
            'os.kill(os.getpid(), signal.SIGINT); '
            'os.execv(sys.executable, [sys.executable, "-m", "experience_cli.main", "list"])')
    command = [sys.executable, '-c', code]
    with Process(command, tmp_path, env=early_python(tmp_path)) as process:
        assert process.popen.wait(20) == 130
    assert process.stderr == 'experience list: stopped\n'


@pytest.mark.parametrize(('arguments', 'program'), [
    (['-m', 'neighbourhood_node.node'], 'neighbourhood_node'),
    (['-m', 'localised_odometry_node.node', '--help'], 'localised_odometry_node'),
    (['-m', 'page_node.node'], 'page_node'),
    (['-m', 'episode_store.task_folder'], None),
    (['-m', 'experience_cli.main', 'list'], 'experience list'),
    (['-m', 'experience_cli.main', '--help'], 'experience'),
    (['/v/bin/experience', 'learn', 'x'], 'experience learn'),
    (['-X', 'importtime', '-u', 'bin/sim_node', '--help'], 'sim_node'),
    (['/ws/lib/experience_controller/teleop_node'], 'teleop_node'),
    (['-m', 'learner_node.node'], 'learner_node'),
    (['-c', 'pass', 'bin/experience'], None), (['/home/me/sim_node'], None), ([], None),
    (['-m', 'pytest', '/v/bin/experience'], None), (['my.py', 'bin/sim_node'], None),
    (['-m'], None)])
def test_only_our_own_programs_are_ended_so(arguments, program):
    assert ours(['python', *arguments]) == program


LOSES = """
import os, signal, sys, time
sys.orig_argv = ['python', '-m', 'experience_cli.main', 'list']
from experience_cli.interrupts import stoppable, Stopped

class Forgetful:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(100_000):
            pass

try:
    with stoppable(on_command_line=True):
        try:
            Forgetful()
            time.sleep(20)
        finally:
            time.sleep(1.2)  # tidying up is not disturbed
            print('tidy', file=sys.stderr)
except Stopped as stopped:
    raise SystemExit(stopped.exit_code)
"""


def test_an_interrupt_that_gets_lost_comes_again_and_only_then(tmp_path):
    with Process([sys.executable, '-c', LOSES], tmp_path, env=child_environment(
            {'PYTHONPATH': str(ROOT)})) as process:
        assert process.popen.wait(20) == 143
    assert process.stderr.splitlines() == ['tidy']


BENT = """
import signal, sys
sys.orig_argv = ['python', '-m', 'experience_cli.main', 'list']
from experience_cli.interrupts import stoppable, Stopped

try:
    with stoppable(on_command_line=True):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            raise OSError('could not load libx.so') from error
except Stopped as stopped:
    raise SystemExit(stopped.exit_code)
"""


def test_an_error_that_an_interrupt_was_made_into_is_no_error(tmp_path):
    with Process([sys.executable, '-c', BENT], tmp_path, env=child_environment(
            {'PYTHONPATH': str(ROOT)})) as process:
        assert process.popen.wait(20) == 130
    assert process.stderr == ''


@pytest.mark.parametrize(('word', 'number'), [
    ('sitecustomize', signal.SIGTERM), (' numpy', signal.SIGHUP)])
def test_so_it_is_for_other_signals_that_end(tmp_path, word, number):
    code, said = interrupted(['-m', 'experience_cli.main', *EVALUATE], tmp_path, word, number,
                             env=early_python(tmp_path))
    assert (code, said) == (128 + number, ['experience evaluate: stopped'])


def test_other_programs_keep_their_ctrl_c():
    before = signal.getsignal(signal.SIGINT)
    with stoppable(on_command_line=False):
        assert signal.getsignal(signal.SIGINT) is before
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize('home', [None, '/proc/none'])
def test_without_a_home_nodes_log_and_figures_are_drawn(tmp_path, home, monkeypatch):
    monkeypatch.delenv('HOME', raising=False)
    variables = {'TMPDIR': str(tmp_path), 'MPLBACKEND': 'nonsense'}
    env = child_environment(variables if home is None else {**variables, 'HOME': home})
    for name in ('ROS_LOG_DIR', 'ROS_HOME', 'MPLCONFIGDIR'):
        env.pop(name, None)
    code = ('import sys; from experience_cli import main; main._prepare_output(); '
            'main.prepare(); main._prepare_drawing(); import rclpy; rclpy.init(); '
            'from experience_cli.figures.drawing import new_figure; '
            'new_figure().savefig("figure.png")')
    with Process([sys.executable, '-c', code], tmp_path, env=env, cwd=tmp_path) as process:
        assert process.popen.wait(180) == 0, process.stderr
    # On a busy machine Matplotlib says that looking for fonts takes it more than 5 s.
    said = [line for line in process.stderr.splitlines() if 'building the font cache' not in line]
    assert said == []
    assert (tmp_path / 'figure.png').stat().st_size > 0
