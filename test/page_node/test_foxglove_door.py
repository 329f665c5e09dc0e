"""The second door, for Foxglove: what comes out is what nodes publish; nothing goes in."""

import json
from pathlib import Path
import sys

from nav_msgs.msg import Odometry
import pytest
from rclpy.serialization import deserialize_message
from websockets.sync.client import connect

from msgs_bridge.node import qos
from page_node.foxglove_door import FoxgloveDoor, open_door, TOPICS
from ros_helpers import ROOT, wait_until

LAYOUT = ROOT / 'config' / 'foxglove_layout.json'


@pytest.fixture
def sdk():
    return pytest.importorskip('foxglove', reason='foxglove-sdk is not installed')


@pytest.fixture
def door(ros_node, sdk):
    door = open_door(ros_node, 0)
    yield door
    door.close()


def test_what_nodes_publish_comes_out_in_the_bytes_it_had(ros_node, door):
    publisher = ros_node.create_publisher(Odometry, 'odom', qos.ODOMETRY_PUB)
    with connect(door.address, subprotocols=['foxglove.sdk.v1'], max_size=None) as viewer:
        told = json.loads(viewer.recv(20.0))
        assert told['op'] == 'serverInfo'
        assert told['capabilities'] == []  # nobody drives from there
        channels = {}
        while len(channels) < len(TOPICS):
            channels |= {each['topic']: each for each in json.loads(viewer.recv(20.0))['channels']}
        odom = channels[ros_node.resolve_topic_name('odom')]
        assert (odom['encoding'], odom['schemaName']) == ('cdr', 'nav_msgs/msg/Odometry')
        assert 'geometry_msgs/Quaternion' in odom['schema']
        viewer.send(json.dumps({'op': 'subscribe', 'subscriptions': [
            {'id': 7, 'channelId': odom['id']}]}))
        msg = Odometry()
        msg.pose.pose.position.x = 1.25

        def received():
            publisher.publish(msg)
            try:
                return viewer.recv(0.05)
            except TimeoutError:
                return None

        found = wait_until(received, node=ros_node, what='a message')
        # One byte says what it is, then come the subscription and a time.
        assert (found[0], int.from_bytes(found[1:5], 'little')) == (1, 7)
        assert deserialize_message(found[13:], Odometry).pose.pose.position.x == 1.25


def test_who_comes_later_gets_what_still_holds(door):
    take = door.channel('other', 'nav_msgs/msg/OccupancyGrid', is_latched=True)
    take(b'1')
    take(b'2')
    with connect(door.address, subprotocols=['foxglove.sdk.v1'], max_size=None) as viewer:
        channels = {}
        while 'other' not in channels:
            told = json.loads(viewer.recv(20.0))
            channels |= {each['topic']: each for each in told.get('channels', [])}
        viewer.send(json.dumps({'op': 'subscribe', 'subscriptions': [
            {'id': 3, 'channelId': channels['other']['id']}]}))
        assert viewer.recv(20.0)[13:] == b'2'


def test_a_port_that_is_taken_is_named(door):
    port = int(door.address.rpartition(':')[2])
    with pytest.raises(ValueError, match=f'foxglove_port is {port}: cannot listen there'):
        FoxgloveDoor(port)


def test_without_the_sdk_it_is_said_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, 'foxglove', None)
    with pytest.raises(ValueError, match='pip install foxglove-sdk'):
        FoxgloveDoor(0)


def test_the_layout_shows_topics_that_there_are():
    layout = json.loads(Path(LAYOUT).read_text())
    panels = layout['configById']
    known = {'/' + name.lstrip('/') for name, _, _ in TOPICS}
    assert set(panels['3D!robot']['topics']) <= known
    assert panels['RawMessages!trial']['topicPath'] in known
    assert all(path['value'].split('.')[0] in known for path in panels['Plot!speed']['paths'])

    def leaves(node):
        return {node} if isinstance(node, str) else leaves(node['first']) | leaves(node['second'])

    assert leaves(layout['layout']) == set(panels)
