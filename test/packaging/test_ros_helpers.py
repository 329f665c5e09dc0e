"""The helpers of the tests, tried on real processes and topics."""

import os
from pathlib import Path
import signal
import sys

import pytest
from std_msgs.msg import String
from std_srvs.srv import Trigger

from experience_cli.demo.processes import free_domain
import forks
from ros_helpers import (
    call, collect, node_command, own_node, Process, ROOT, run, start_node, wait_until)

PARAMETERS = """
import rclpy
from msgs_bridge.node.command_line import Program
from msgs_bridge.node.run import run_node
from std_msgs.msg import Empty

def node():
    node = rclpy.create_node('a', automatically_declare_parameters_from_overrides=True)
    print({k: p.value for k, p in node._parameters.items() if k in ('x', 'y', 'z', 'w')})
    node.create_publisher(Empty, 't', 1)
    print(node.get_fully_qualified_name(), node.resolve_topic_name('t'))
    return node

def main():
    run_node(Program('a', 'Waits', '-p x:=1', ('x',)), node)
"""


def test_domains_are_held_once():
    with free_domain() as first, free_domain() as second:
        assert first != second
    with free_domain() as third:
        assert third in range(1, 101)


def test_a_domain_is_free_again():
    with free_domain() as first:
        pass
    with free_domain() as second:
        assert second == first


def test_two_nodes_hear_each_other(ros_domain, ros_node):
    messages = collect(ros_node, String, 'words')
    with own_node(ros_domain, 'other') as other:
        publisher = other.create_publisher(String, 'words', 10)
        wait_until(publisher.get_subscription_count, node=other, what='the subscription')
        publisher.publish(String(data='hello'))
        wait_until(lambda: messages, node=ros_node)
    assert [message.data for message in messages] == ['hello']


def test_a_service_answers(ros_domain, ros_node):
    def answer(_, response):
        response.message = 'yes'
        return response

    ros_node.create_service(Trigger, 'ask', answer)
    assert call(ros_node, Trigger, 'ask').message == 'yes'


def test_waiting_ends_with_a_reason():
    with pytest.raises(AssertionError, match=r'tea did not come within 0\.05 s'):
        wait_until(lambda: None, 0.05, what='tea')


def test_waiting_ends_with_the_process(tmp_path):
    with Process([sys.executable, '-c', 'import sys; sys.exit("no tea")'], tmp_path) as child:
        with pytest.raises(AssertionError, match=r'ended with 1(.|\n)*no tea'):
            wait_until(lambda: False, processes=[child])


def test_run_keeps_what_was_written(tmp_path):
    code = 'import sys; print("out"); print("err", file=sys.stderr); sys.exit(2)'
    done = run([sys.executable, '-c', code], tmp_path)
    assert (done.popen.returncode, done.stdout, done.stderr) == (2, 'out\n', 'err\n')


def test_a_forked_node_is_a_process_of_its_own(tmp_path, quiet_domain):
    first, second = (start_node('sim_node.node', tmp_path) for _ in range(2))
    for process in (first, second):
        wait_until(lambda: 'world open' in process.stderr, processes=[process])  # noqa: B023
        assert os.getsid(process.popen.pid) == os.getpgid(process.popen.pid) == process.popen.pid
        place = Path('/proc') / str(process.popen.pid)
        assert (place / 'cwd').readlink() == ROOT
        assert (place / 'fd' / '0').readlink() == Path(os.devnull)
    first.kill()
    assert first.popen.returncode == -signal.SIGKILL
    assert second.running
    second.stop(signal.SIGTERM)


@pytest.mark.parametrize('is_forked', [True, False])
def test_a_program_ends_the_same_however_it_begins(tmp_path, quiet_domain, is_forked):
    env = {'ROS_DOMAIN_ID': '233', **({} if is_forked else {'PYTHONHASHSEED': '1'})}
    command = node_command('sim_node.node', tmp_path)
    assert forks.is_forkable(command, env) == is_forked
    done = run(command, tmp_path, env)
    assert (done.popen.returncode, done.stdout) == (2, '')
    [line] = done.stderr.splitlines()
    assert line.startswith('sim_node: ROS_DOMAIN_ID is 233')
    with pytest.raises(AssertionError, match='did not end within 0'):
        start_node('sim_node.node', tmp_path, env=env | {'ROS_DOMAIN_ID': '1'}).wait(0.0)


def test_an_error_code_on_interrupt_fails(tmp_path):
    code = 'import time; print("up"); time.sleep(60)'
    child = Process([sys.executable, '-c', code], tmp_path)
    wait_until(lambda: child.stdout, processes=[child])
    with pytest.raises(AssertionError, match='KeyboardInterrupt'):
        child.stop()


def test_what_does_not_end_is_killed(tmp_path):
    code = 'import signal, time; signal.signal(2, signal.SIG_IGN); print("up"); time.sleep(60)'
    child = Process([sys.executable, '-c', code], tmp_path)
    wait_until(lambda: child.stdout, processes=[child])
    with pytest.raises(AssertionError, match='did not end'):
        child.stop(deadline=0.2)
    assert not child.running


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_node_gets_its_arguments_and_stops(tmp_path, ros_domain, number):
    (tmp_path / 'a_node.py').write_text(PARAMETERS)
    env = {'PYTHONPATH': str(tmp_path)}
    values = {'x': 1, 'y': 2.5, 'z': 'text', 'w': [True, False]}
    with start_node('a_node', tmp_path, values, env=env, namespace='/robot', name='b',
                    remappings={'t': 'u'}) as child:
        lines = wait_until(lambda: child.stdout.count('\n') == 2 and child.stdout.splitlines(),
                           processes=[child])
        child.stop(number)
    assert lines[1] == '/robot/b /robot/u'
    for text in ("'x': 1", "'y': 2.5", "'z': 'text'", "'w': [True, False]"):
        assert text in lines[0]
    assert child.stderr == ''
