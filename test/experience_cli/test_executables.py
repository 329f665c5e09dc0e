"""A node that is stopped while Python is still importing says nothing about it."""

from itertools import cycle
import signal
import sys

import pytest

from experience_cli import executables
from ros_helpers import Process, wait_until

NODES = ['control_field_node', 'learner_node', 'localised_odometry_node', 'neighbourhood_node',
         'page_node', 'sim_node', 'teleop_node']


def test_there_is_one_for_every_node():
    assert sorted(name for name in vars(executables) if name.endswith('_node')) == NODES


@pytest.mark.parametrize(('name', 'number'), list(zip(
    NODES, cycle([signal.SIGINT, signal.SIGTERM]), strict=False)))
def test_a_signal_between_two_imports(tmp_path, quiet_domain, name, number):
    # rclpy comes in many parts, each with a line when it is there; the first is soon followed.
    code = f'from experience_cli.executables import {name}; {name}()'
    command = [sys.executable, '-X', 'importtime', '-c', code]
    with Process(command, tmp_path) as process:
        wait_until(lambda: ' rclpy' in process.stderr or ' numpy' in process.stderr,
                   processes=[process], what='the imports')
        process.send(number)
        assert process.popen.wait(20) == 0
    assert 'Traceback' not in process.stderr
    assert 'KeyboardInterrupt' not in process.stderr
