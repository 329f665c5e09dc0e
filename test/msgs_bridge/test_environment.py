"""The environment of child processes."""

import os
import subprocess
import sys

import pytest

from msgs_bridge.node.environment import child_environment, prepare

CODE = 'import rclpy, msgs_bridge, os; print(os.environ["AMENT_PREFIX_PATH"])'


@pytest.mark.parametrize('kept', [
    ('LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE'), ('_ROS_WHEELS_BOOTSTRAP_COMPLETE',),
    ('LD_LIBRARY_PATH',), ()], ids=' and '.join)
def test_a_child_finds_ros_and_these_packages_from_anywhere(kept, monkeypatch, tmp_path):
    for name in ('LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE'):
        if name not in kept:
            monkeypatch.delenv(name, raising=False)
    if 'LD_LIBRARY_PATH' not in kept:
        monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    monkeypatch.delenv('PYTHONPATH', raising=False)
    ran = subprocess.run([sys.executable, '-c', CODE], env=child_environment({'A': 'b'}),
                         capture_output=True, text=True, cwd=tmp_path, timeout=60, check=False)
    assert (ran.returncode, ran.stderr) == (0, '')
    assert ran.stdout.strip()


def test_what_is_set_is_kept(monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', '/opt/ros/jazzy')
    monkeypatch.setenv('PYTHONPATH', '/somewhere')
    prepare()
    environment = child_environment()
    assert environment['AMENT_PREFIX_PATH'] == '/opt/ros/jazzy'
    assert environment['PYTHONPATH'].startswith('/somewhere:')
    assert child_environment({'ROS_DOMAIN_ID': '7'})['ROS_DOMAIN_ID'] == '7'


def test_prepare_sets_the_prefix_of_the_wheels(monkeypatch):
    monkeypatch.delenv('AMENT_PREFIX_PATH')
    prepare()
    assert os.environ['AMENT_PREFIX_PATH'] == sys.prefix
