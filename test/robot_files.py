"""Small robots of our own: a description, and parameter files of Nav2 and of a controller."""

BOX = """
  <link name="base_link">
    <collision><origin xyz="0.05 0 0.1"/><geometry><box size="0.6 0.4 0.2"/></geometry></collision>
  </link>"""
BASE = """
  <link name="base_footprint"/>
  <joint name="base_joint" type="fixed">
    <parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.05"/>
  </joint>"""
WHEELS = ''.join(f"""
  <link name="{side}_wheel">
    <collision><geometry><cylinder radius="0.06" length="0.04"/></geometry></collision>
  </link>
  <joint name="{side}_wheel_joint" type="continuous">
    <parent link="base_link"/><child link="{side}_wheel"/>
    <origin xyz="0 {y} 0.01" rpy="-1.5707963 0 0"/><axis xyz="0 0 1"/>
    <limit effort="1" velocity="10"/>
  </joint>""" for side, y in (('left', 0.17), ('right', -0.17)))
# The mast is turned to the left, and the laser hangs on it upside down.
LASER = """
  <link name="mast"/>
  <joint name="mast_joint" type="fixed">
    <parent link="base_link"/><child link="mast"/><origin xyz="0.2 0 0.2" rpy="0 0 1.5707963"/>
  </joint>
  <link name="laser"/>
  <joint name="laser_joint" type="fixed">
    <parent link="mast"/><child link="laser"/>
    <origin xyz="0.1 0 0.05" rpy="3.1415927 0 0"/>
  </joint>
  <gazebo reference="laser">
    <sensor name="lidar" type="gpu_lidar">
      <lidar>
        <scan><horizontal>
          <samples>360</samples><min_angle>-3.14</min_angle><max_angle>3.14</max_angle>
        </horizontal></scan>
        <range><min>0.1</min><max>8.0</max></range>
      </lidar>
      <topic>front/scan</topic>
    </sensor>
  </gazebo>"""
CLIFF = """
  <link name="cliff"/>
  <joint name="cliff_joint" type="fixed">
    <parent link="base_link"/><child link="cliff"/>
  </joint>
  <gazebo reference="cliff">
    <sensor name="cliff" type="ray">
      <ray><scan><horizontal>
        <samples>1</samples><min_angle>0</min_angle><max_angle>0</max_angle>
      </horizontal></scan></ray>
    </sensor>
  </gazebo>"""
DIFF_DRIVE = """
  <gazebo>
    <plugin filename="gz-sim-diff-drive-system" name="gz::sim::systems::DiffDrive">
      <wheel_separation>0.35</wheel_separation>
      <max_linear_velocity>0.8</max_linear_velocity>
      <max_linear_acceleration>1.5</max_linear_acceleration>
      <min_linear_acceleration>-1.2</min_linear_acceleration>
      <max_angular_velocity>1.8</max_angular_velocity>
      <frame_id>robot_odom</frame_id>
    </plugin>
  </gazebo>"""
ROUND = """
  <link name="base_link">
    <collision><geometry><cylinder radius="0.2" length="0.3"/></geometry></collision>
  </link>"""

NAV2 = """
local_costmap:
  local_costmap:
    ros__parameters:
      global_frame: odom
      robot_base_frame: base_link
      footprint: "[ [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2] ]"
      obstacle_layer:
        observation_sources: scan
        scan: {topic: /front/scan, data_type: LaserScan, raytrace_max_range: 6.0}
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_mppi_controller::MPPIController
      motion_model: DiffDrive
      vx_max: 0.6
      vx_min: -0.35
      vy_max: 0.5
      wz_max: 1.9
      ax_max: 3.0
      ax_min: -2.5
      az_max: 3.5
velocity_smoother:
  ros__parameters:
    max_velocity: [0.5, 0.0, 2.0]
    max_accel: [2.5, 0.0, 3.2]
    max_decel: [-2.0, 0.0, -3.2]
    enable_stamped_cmd_vel: true
amcl:
  ros__parameters: {odom_frame_id: odom, base_frame_id: base_footprint, scan_topic: scan}
"""
CONTROLLER = """
/**/base_controller:
  ros__parameters:
    left_wheel_names: [left_wheel_joint]
    right_wheel_names: [right_wheel_joint]
    wheel_separation: 0.34
    wheel_separation_multiplier: 1.5
    base_frame_id: base_footprint
    cmd_vel_timeout: 0.25
    use_stamped_vel: false
    linear.x.max_velocity: 1.0
    linear.x.max_acceleration: 20.0
    angular.z.max_velocity: 2.5
"""


def urdf(*parts):
    """Return a description made of parts."""
    return '<?xml version="1.0"?>\n<robot name="small">' + ''.join(parts) + '\n</robot>\n'


BOX_ROBOT = urdf(BASE, BOX, WHEELS, LASER, CLIFF, DIFF_DRIVE)
