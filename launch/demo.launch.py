"""
Teach and try one of the paper's tasks in real time, for a person to watch.

Simulator, controller and learner are started; `experience demo --attach` drives the demonstration
in the open workspace, lets the task's obstacles appear and has the robot try. The nodes go on
after that, for more trials or demonstrations, until Ctrl-C.

`ros2 launch experience_controller demo.launch.py task:=1 rviz:=true`

Its nodes meet nobody else's: they are found on this machine alone, in a ROS domain of this user's,
unless `discovery`, `domain` or ROS_DOMAIN_ID say otherwise.
"""

import os

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, LogInfo, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare

PACKAGE = 'experience_controller'


def generate_launch_description() -> LaunchDescription:
    """Return the three nodes, who teaches them, and RViz if it is asked for."""
    config = PathJoinSubstitution([FindPackageShare(PACKAGE), 'config'])
    task = ['task', LaunchConfiguration('task')]
    return LaunchDescription([
        *arguments(),
        *isolation(),
        node('sim_node', {'world': 'open', 'speed_factor': argument('speed_factor', float)}),
        node('control_field_node', {}),
        node('learner_node', {
            'task': ParameterValue(task, value_type=str),
            'bags': argument('bags', str),
            'auto_trials': argument('trials', int),
        }),
        teacher(),
        *rviz(PathJoinSubstitution([config, 'experience.rviz'])),
    ])


def isolation() -> list[SetEnvironmentVariable | LogInfo]:
    """Return what keeps the nodes apart from those of others, and how to get among them."""
    domain, discovery = LaunchConfiguration('domain'), LaunchConfiguration('discovery')
    return [
        SetEnvironmentVariable('ROS_DOMAIN_ID', domain),
        SetEnvironmentVariable('ROS_AUTOMATIC_DISCOVERY_RANGE', discovery),
        LogInfo(msg=['to reach these nodes from other terminals: export ROS_DOMAIN_ID=', domain,
                     ' ROS_AUTOMATIC_DISCOVERY_RANGE=', discovery]),
    ]


def own_domain() -> str:
    """Return the ROS domain that is set, or one that other users of this machine have not."""
    return os.environ.get('ROS_DOMAIN_ID') or str(1 + os.getuid() % 100)


def teacher() -> ExecuteProcess:
    """Return who shows the robot the way once, and lets it try."""
    return ExecuteProcess(
        cmd=[ExecutableInPackage('experience', PACKAGE), 'demo', '--attach',
             '--tasks', LaunchConfiguration('task'), '--trials', LaunchConfiguration('trials'),
             # One word each: what is empty must not look like what is missing.
             ['--movers=', LaunchConfiguration('movers')],
             ['--namespace=', LaunchConfiguration('namespace')]],
        name='teacher', output='screen')


def rviz(config: PathJoinSubstitution) -> list[Node]:
    """Return RViz and, as nobody else publishes tf, the transform it takes its frame from."""
    wanted = IfCondition(LaunchConfiguration('rviz'))
    return [
        Node(package='rviz2', executable='rviz2', namespace=LaunchConfiguration('namespace'),
             arguments=['-d', config], parameters=[{'use_sim_time': True}], condition=wanted),
        Node(package='tf2_ros', executable='static_transform_publisher', condition=wanted,
             arguments=['--frame-id', 'map', '--child-frame-id', 'odom']),
    ]


def arguments() -> list[DeclareLaunchArgument]:
    """Return what can be said on the command line."""
    return [
        DeclareLaunchArgument('task', default_value='1', choices=['1', '2'],
                              description="which of the paper's tasks"),
        DeclareLaunchArgument('trials', default_value='6',
                              description='how many trials run by themselves'),
        DeclareLaunchArgument('movers', default_value='',
                              description='who moves meanwhile: crossing, door or a file'),
        DeclareLaunchArgument('bags', default_value='bags', description="the robot's memory"),
        DeclareLaunchArgument('speed_factor', default_value='1.0',
                              description='simulated seconds in a second'),
        DeclareLaunchArgument('namespace', default_value='', description='of all nodes'),
        DeclareLaunchArgument('domain', default_value=own_domain(),
                              description='ROS_DOMAIN_ID of all nodes'),
        DeclareLaunchArgument('discovery', default_value='LOCALHOST',
                              choices=['LOCALHOST', 'SUBNET', 'SYSTEM_DEFAULT'],
                              description='who finds the nodes: this machine, or all the network'),
        DeclareLaunchArgument('rviz', default_value='false', choices=['true', 'false'],
                              description='whether to show it in RViz'),
    ]


def argument(name: str, kind: type) -> ParameterValue:
    """Return the value of an argument as a parameter of that type."""
    return ParameterValue(LaunchConfiguration(name), value_type=kind)


def node(name: str, parameters: dict[str, object]) -> Node:
    """Return one of our nodes, with the parameters of demo.yaml and these on top."""
    common = PathJoinSubstitution([FindPackageShare(PACKAGE), 'config', 'demo.yaml'])
    return Node(package=PACKAGE, executable=name, name=name, output='screen',
                namespace=LaunchConfiguration('namespace'), parameters=[common, parameters])
