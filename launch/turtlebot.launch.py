"""
Start sight, controller and learner on a TurtleBot that has been brought up.

`ros2 launch experience_controller turtlebot.launch.py robot:=turtlebot3_burger task:=kitchen`, and
in a terminal of its own `ros2 run experience_controller teleop_node` with the robot's parameters.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = 'experience_controller'


def generate_launch_description() -> LaunchDescription:
    """Return the three nodes."""
    stamped = {'enable_stamped_cmd_vel': argument('enable_stamped_cmd_vel', bool)}
    return LaunchDescription([
        *arguments(),
        node('neighbourhood_node', {
            'source': argument('source', str),
            'timeout': argument('sight_timeout', float),
            'lethal_threshold': argument('lethal_threshold', int),
        }, [('scan', LaunchConfiguration('scan')), ('costmap', LaunchConfiguration('costmap'))]),
        node('control_field_node', stamped),
        node('learner_node', {
            **stamped,
            'simulation': False,
            'task': argument('task', str),
            'bags': argument('bags', str),
        }),
    ])


def arguments() -> list[DeclareLaunchArgument]:
    """Return what can be said on the command line."""
    return [
        DeclareLaunchArgument(
            'robot', default_value='turtlebot3_burger',
            choices=['turtlebot3_burger', 'turtlebot3_waffle', 'turtlebot4'],
            description='which file of config/robots tells of body, laser and workspace'),
        DeclareLaunchArgument('namespace', default_value='', description='of the robot'),
        # A TurtleBot3 on Jazzy reads TwistStamped, the base of a TurtleBot 4 reads Twist.
        DeclareLaunchArgument(
            'enable_stamped_cmd_vel',
            default_value=PythonExpression(["'", LaunchConfiguration('robot'),
                                            "' != 'turtlebot4'"]),
            description='whether the robot reads cmd_vel as TwistStamped instead of Twist'),
        DeclareLaunchArgument('source', default_value='scan', choices=['scan', 'costmap'],
                              description='what the neighbourhood is made from'),
        DeclareLaunchArgument('scan', default_value='scan', description='topic of the laser'),
        DeclareLaunchArgument('costmap', default_value='local_costmap/costmap',
                              description='topic of the costmap'),
        DeclareLaunchArgument('lethal_threshold', default_value='100',
                              description='least value of the costmap that blocks'),
        DeclareLaunchArgument('sight_timeout', default_value='0.5',
                              description='age from which scan or costmap tell nothing, [s]'),
        DeclareLaunchArgument('task', default_value='task', description='name of the task'),
        DeclareLaunchArgument('bags', default_value='bags', description="the robot's memory"),
    ]


def argument(name: str, kind: type) -> ParameterValue:
    """Return the value of an argument as a parameter of that type."""
    return ParameterValue(LaunchConfiguration(name), value_type=kind)


def node(
    name: str, parameters: dict[str, object], remappings: list[tuple[str, object]] | None = None,
) -> Node:
    """Return one of our nodes, with the robot's parameters and these on top."""
    file = PythonExpression(["'", LaunchConfiguration('robot'), ".yaml'"])
    robot = PathJoinSubstitution([FindPackageShare(PACKAGE), 'config', 'robots', file])
    return Node(package=PACKAGE, executable=name, name=name, output='screen',
                namespace=LaunchConfiguration('namespace'), parameters=[robot, parameters],
                remappings=remappings or [])
