"""Whoever runs the demo's nodes keeps them, and what drives them, on this machine."""

import os
import sys

import pytest

from experience_cli.demo.processes import own_domain
import ros_helpers

#: Prints the discovery port of the domain if this process's node listens on it to the network.
LOOK = """
import os
from pathlib import Path
import sys
from experience_cli.demo.processes import own_domain
from experience_cli.demo.client_node import DemoNode

def ports():
    mine = {str(os.readlink(path)) for path in Path('/proc/self/fd').iterdir()
            if path.is_symlink()}
    for line in Path('/proc/net/udp').read_text().splitlines()[1:]:
        fields = line.split()
        if f'socket:[{fields[9]}]' in mine:
            yield int(fields[1].split(':')[1], 16)

def look(domain):
    with DemoNode(domain, lambda: None):
        found = set(ports())
    assert found
    print('open' if 7400 + 250 * domain in found else 'closed')

for discovery in sys.argv[2:]:
    os.environ.pop('ROS_AUTOMATIC_DISCOVERY_RANGE', None)
    if discovery != 'unset':
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = discovery
    before = dict(os.environ)
    with own_domain() as environment:
        look(int(environment.get('ROS_DOMAIN_ID', sys.argv[1])))
    assert dict(os.environ) == before
    look(int(sys.argv[1]))
"""


@pytest.mark.skipif(sys.platform != 'linux', reason='looks into /proc')
def test_the_node_that_drives_is_kept_on_this_machine(ros_domain, tmp_path):
    # The look does tell the difference, and what the user has set is his again.
    afterwards = {'unset': 'open', 'SUBNET': 'open', 'SYSTEM_DEFAULT': 'open', 'OFF': 'closed'}
    done = ros_helpers.run([sys.executable, '-c', LOOK, str(ros_domain), *afterwards], tmp_path)
    assert done.popen.returncode == 0, done.report()
    assert done.stdout.split() == [
        word for after in afterwards.values() for word in ('closed', after)]


@pytest.mark.parametrize('domain', ['', '17'])
def test_children_stay_there_too_on_the_domain_that_was_set(monkeypatch, domain):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    monkeypatch.setenv('ROS_STATIC_PEERS', '192.0.2.1')
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)
    with own_domain() as environment:
        assert environment['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
        assert environment['ROS_STATIC_PEERS'] == ''
        assert ('ROS_DOMAIN_ID' in environment) == (not domain)
    assert os.environ['ROS_STATIC_PEERS'] == '192.0.2.1'
