"""
Start what turtlebot.launch.py starts, and a page to teach from, on a robot that was brought up.

`ros2 launch experience_controller page.launch.py robot:=turtlebot3_burger task:=kitchen`, and open
the address that page_node prints. `host:=0.0.0.0` lets phones and other machines in, if they have
the token that stands in the address. All arguments of turtlebot.launch.py can be given here.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import (
    LaunchConfiguration, PathJoinSubstitution, PythonExpression, ThisLaunchFileDir)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PACKAGE = 'experience_controller'


def generate_launch_description() -> LaunchDescription:
    """Return the nodes that teach and drive, which declare their arguments, and the page."""
    robot = PathJoinSubstitution([ThisLaunchFileDir(), 'turtlebot.launch.py'])
    return LaunchDescription([
        *arguments(),
        IncludeLaunchDescription(PythonLaunchDescriptionSource(robot)),
        Node(package=PACKAGE, executable='page_node', name='page_node', output='screen',
             namespace=LaunchConfiguration('namespace'),
             remappings=[('odom', odometry())],
             parameters=[LaunchConfiguration('params_file'), {
                 'enable_stamped_cmd_vel': argument('enable_stamped_cmd_vel', bool),
                 'simulation': False,
                 'bags': argument('bags', str),
                 'host': argument('host', str),
                 'port': argument('port', int),
                 'token': argument('token', str),
             }]),
    ])


def arguments() -> list[DeclareLaunchArgument]:
    """Return what can be said on the command line about the page itself."""
    return [
        DeclareLaunchArgument('host', default_value='127.0.0.1',
                              description='who can open the page: this machine alone, or with '
                                          '0.0.0.0 whoever has the token'),
        DeclareLaunchArgument('port', default_value='8300', description='port of the page'),
        DeclareLaunchArgument('token', default_value='',
                              description='what the address must contain; empty: one is made '
                                          'where other machines can come in'),
    ]


def odometry() -> PythonExpression:
    """Return the topic that the robot of turtlebot.launch.py goes by."""
    return PythonExpression([
        "'localised_odom' if '", LaunchConfiguration('pose_topic'), "' else '",
        LaunchConfiguration('odom'), "'"])


def argument(name: str, kind: type) -> ParameterValue:
    """Return the value of an argument as a parameter of that type."""
    return ParameterValue(LaunchConfiguration(name), value_type=kind)
