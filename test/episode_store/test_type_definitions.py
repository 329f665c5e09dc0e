"""Definitions and hashes of message types, against two other implementations."""

from mcap_ros2._dynamic import generate_dynamic
import pytest
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.type_definitions import message_definition, type_hash
from msgs_bridge.messages.cdr import DESCRIBED

RULE = '=' * 80
STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = sorted({*DESCRIBED, 'visualization_msgs/msg/MarkerArray', 'rosgraph_msgs/msg/Clock',
                'diagnostic_msgs/msg/DiagnosticArray', 'sensor_msgs/msg/LaserScan'})


@pytest.mark.parametrize('name', TYPES)
def test_the_hash_is_that_of_another_implementation(name):
    assert type_hash(name) == STORE.hash_rihs01(name)


@pytest.mark.parametrize('name', TYPES)
def test_a_definition_is_complete(name):
    definition = message_definition(name)
    known = get_types_from_msg(definition, name)
    assert known == {part: STORE.fielddefs[part] for part in known}
    assert name in generate_dynamic(name, definition)


def test_parts_are_joined_as_rosbag2_joins_them():
    parts = message_definition('geometry_msgs/msg/TwistStamped').split(f'\n{RULE}\n')
    assert [part.splitlines()[0] for part in parts[1:]] == [
        'MSG: geometry_msgs/Twist', 'MSG: geometry_msgs/Vector3', 'MSG: std_msgs/Header',
        'MSG: builtin_interfaces/Time']


@pytest.mark.parametrize('name', [
    'none_msgs/msg/None', 'nav_msgs/msg/None', '../etc/passwd', 'nav_msgs', 'nav_msgs/srv/GetMap'])
def test_what_is_not_installed_is_named(name):
    with pytest.raises(BagError, match=name.replace('.', r'\.')):
        message_definition(name)
    assert type_hash(name) == ''


def test_share_folders_of_a_ros_install_come_first(tmp_path, monkeypatch):
    folder = tmp_path / 'share' / 'own_msgs' / 'msg'
    folder.mkdir(parents=True)
    (folder / 'Thing.msg').write_text(
        'int32 SIZE=3  # a constant\nstring<=5 name\nfloat64[<=3] values\n'
        'nav_msgs/Odometry[] odom # Other other\nOther other\n')
    (folder / 'Other.msg').write_text('wstring text\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path / "none"}:{tmp_path}')
    definition = message_definition('own_msgs/msg/Thing')
    assert definition.count(RULE) == 11
    assert 'MSG: own_msgs/Other\nwstring text' in definition
