"""
Start local grid, controller and learner on a robot that has been brought up.

`ros2 launch experience_controller turtlebot.launch.py robot:=turtlebot3_burger task:=kitchen`, and
in a terminal of its own `ros2 run experience_controller teleop_node` with the robot's parameters.
With `pose_topic:=amcl_pose` everything happens in the frame of that localisation's map.

The robot is met on the network, so the ROS domain is the one that is set: two robots on one
network need a domain or a namespace each.
"""

import os

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = 'experience_controller'


def generate_launch_description() -> LaunchDescription:
    """Return the three nodes, and that of the localised odometry if there is a pose topic."""
    stamped = {'enable_stamped_cmd_vel': argument('enable_stamped_cmd_vel', bool)}
    frame = {'frame_id': argument('frame_id', str)}
    odom = ('odom', PythonExpression([
        "'localised_odom' if '", LaunchConfiguration('pose_topic'), "' else '",
        LaunchConfiguration('odom'), "'"]))
    is_localised = PythonExpression(["'", LaunchConfiguration('pose_topic'), "' != ''"])
    return LaunchDescription([
        *arguments(),
        LogInfo(msg=[f'ROS_DOMAIN_ID is {os.environ.get("ROS_DOMAIN_ID", "0")}, namespace /',
                     LaunchConfiguration('namespace'),
                     ': whoever is in both on this network commands this robot; another robot ',
                     'needs another domain or namespace:=']),
        node('localised_odometry_node', {**frame, 'pose_topic': argument('pose_topic', str)},
             [('odom', LaunchConfiguration('odom'))],
             condition=IfCondition(is_localised)),
        node('neighbourhood_node', {
            **frame,
            'source': argument('source', str),
            'timeout': argument('sight_timeout', float),
            'lethal_threshold': argument('lethal_threshold', int),
        }, [odom, ('scan', LaunchConfiguration('scan')),
            ('costmap', LaunchConfiguration('costmap'))]),
        node('control_field_node', {**stamped, 'heartbeat': argument('heartbeat', bool)}, [odom]),
        node('learner_node', {
            **stamped,
            **frame,
            'simulation': False,
            'task': argument('task', str),
            'new_task': argument('new_task', bool),
            'bags': argument('bags', str),
        }, [odom]),
    ])


def arguments() -> list[DeclareLaunchArgument]:
    """Return what can be said on the command line."""
    return [
        DeclareLaunchArgument(
            'robot', default_value='turtlebot3_burger',
            choices=['turtlebot3_burger', 'turtlebot3_waffle', 'turtlebot4', 'turtlebot4_lite',
                     'create3', 'jackal', 'rosbot', 'mir100'],
            description='which file of config/robots tells of body and laser'),
        DeclareLaunchArgument(
            'params_file',
            default_value=PathJoinSubstitution([
                FindPackageShare(PACKAGE), 'config', 'robots',
                PythonExpression(["'", LaunchConfiguration('robot'), ".yaml'"])]),
            description='a file of your own like those, instead; `experience robot` writes one'),
        DeclareLaunchArgument(
            'pose_topic', default_value='',
            description='pose of a localisation, such as amcl_pose, or /tf for its transform; '
                        'empty: odometry is taken at its word'),
        DeclareLaunchArgument(
            'frame_id', default_value=either('map', 'odom'),
            description='frame of the workspace: that of the localisation, or of odometry'),
        DeclareLaunchArgument('odom', default_value='odom', description="the wheels' odometry"),
        DeclareLaunchArgument('namespace', default_value='', description='of the robot'),
        # A TurtleBot3 on Jazzy reads TwistStamped; of the others it is told here if theirs does.
        DeclareLaunchArgument(
            'enable_stamped_cmd_vel',
            default_value=PythonExpression(["'", LaunchConfiguration('robot'),
                                            "'.startswith('turtlebot3')"]),
            description='whether the robot reads cmd_vel as TwistStamped instead of Twist'),
        DeclareLaunchArgument('source', default_value='scan', choices=['scan', 'costmap'],
                              description='what the neighbourhood is made from'),
        DeclareLaunchArgument('scan', default_value='scan', description='topic of the laser'),
        # Nav2's local costmap is in the frame of odometry, the global one in that of the map.
        DeclareLaunchArgument(
            'costmap', default_value=either('global_costmap/costmap', 'local_costmap/costmap'),
            description='topic of the costmap, which has to be in the frame of the workspace'),
        DeclareLaunchArgument('lethal_threshold', default_value='100',
                              description='least value of the costmap that blocks'),
        DeclareLaunchArgument('sight_timeout', default_value='0.5',
                              description='age from which scan or costmap tell nothing, [s]'),
        DeclareLaunchArgument('heartbeat', default_value='true', choices=['true', 'false'],
                              description='whether a trial needs a living teleop_node'),
        DeclareLaunchArgument('task', default_value='task', description='name of the task'),
        DeclareLaunchArgument('new_task', default_value='false', choices=['true', 'false'],
                              description='begin it also where its name is nearly that of an '
                                          'old one'),
        DeclareLaunchArgument('bags', default_value='bags', description="the robot's memory"),
    ]


def either(localised: str, alone: str) -> PythonExpression:
    """Return the one with a localisation, the other without."""
    return PythonExpression([
        f"'{localised}' if '", LaunchConfiguration('pose_topic'), f"' else '{alone}'"])


def argument(name: str, kind: type) -> ParameterValue:
    """Return the value of an argument as a parameter of that type."""
    return ParameterValue(LaunchConfiguration(name), value_type=kind)


def node(
    name: str, parameters: dict[str, object], remappings: list[tuple[str, object]] | None = None,
    **options: object,
) -> Node:
    """Return one of our nodes, with the robot's parameters and these on top."""
    return Node(package=PACKAGE, executable=name, name=name, output='screen',
                namespace=LaunchConfiguration('namespace'), remappings=remappings or [],
                parameters=[LaunchConfiguration('params_file'), parameters], **options)
