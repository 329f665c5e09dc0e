"""The node `sim_node` as a process of its own, on real topics."""

import math
import signal

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
import numpy as np
import pytest
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from control_field.grid import Grid
from msgs_bridge.messages.neighbourhoods import neighbourhood_from_grid, occupancy_from_map
from msgs_bridge.messages.poses import (
    initialpose_from_pose, Pose, pose_from_odometry, seconds_from_stamp)
from msgs_bridge.node import qos
import ros_helpers
from simulator_peer import Peer, simulator, START
from world_maps.world import find_world, load_world

GRID = Grid(20, 20, 0.25)


def set_parameters(node, **values):
    request = SetParameters.Request(parameters=[
        Parameter(name, value=value).to_parameter_msg() for name, value in values.items()])
    return ros_helpers.call(node, SetParameters, '/sim_node/set_parameters', request).results


COMMANDS = [(0.22 * math.sin(n / 7), 2.0 * math.cos(n / 5)) for n in range(60)]


class TestLockStep:
    def run_once(self, domain, folder):
        with ros_helpers.own_node(domain) as node, simulator(
                node, folder, lockstep=True, world='task1', movers='crossing', slip=0.05,
                noise_std=0.02, heading_drift=0.0175, seed=5) as peer:
            first = peer.first_tick(Pose(0.0, 1.75, 0.9, 0.0))
            peer.drive(COMMANDS)
            # Stamps tell ticks apart: what is equal is a tick repeated for a late reader.
            return [[data for data in dict.fromkeys(bytes(d) for k, d in peer.events if k is kind)
                     if self.stamp(kind, data) >= seconds_from_stamp(first.header.stamp)]
                    for kind in (Odometry, OccupancyGrid)]

    def stamp(self, kind, data):
        return seconds_from_stamp(deserialize_message(data, kind).header.stamp)

    def test_two_runs_give_the_same_bytes(self, ros_domain, tmp_path):
        first, again = (self.run_once(ros_domain, tmp_path) for _ in range(2))
        assert [len(messages) for messages in first] == [len(COMMANDS) + 1] * 2
        assert first == again

    def test_a_tick_is_neighbourhood_and_odometry_of_one_stamp(self, ros_node, tmp_path):
        clocks = ros_helpers.collect(ros_node, Clock, '/clock')
        with simulator(ros_node, tmp_path, lockstep=True, rate=10.0) as peer:
            peer.first_tick()
            last = peer.drive([(0.2, 0.0)] * 10)
            local_grids, poses = peer.of(OccupancyGrid), peer.of(Odometry)
            of_grids, of_poses = ([message.header.stamp for message in some[-11:]]
                                  for some in (local_grids, poses))
            assert of_grids == of_poses
            peer.wait(lambda: clocks and clocks[-1].clock == last.header.stamp, 'the clock')
            pose = pose_from_odometry(last)
            assert (pose.x, pose.y) == (pytest.approx(0.825), 0.875)
            assert (pose.v, pose.w, pose.frame_id) == (0.2, 0.0, 'odom')
            assert last.child_frame_id == 'base_footprint'
            seen = neighbourhood_from_grid(local_grids[-1], GRID)
            assert (seen.row, seen.col) == GRID.cell_from_world(pose.x, pose.y)
            steps = np.diff([seconds_from_stamp(p.header.stamp) for p in poses[-11:]])
            np.testing.assert_allclose(steps, 0.1, atol=1e-9)

    def test_only_the_answer_to_the_last_tick_counts(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, lockstep=True) as peer:
            first = peer.first_tick()
            second = peer.drive([(0.1, 0.0)])
            peer.command(0.2, 0.0, first.header.stamp)
            peer.command(0.2, 0.0)
            peer.command(math.nan, 0.0, second.header.stamp)
            third = peer.drive([(0.1, 0.0)])
            assert third.twist.twist.linear.x == 0.1
            assert pose_from_odometry(third).x == pytest.approx(0.625 + 2 * 0.005)
            gap = seconds_from_stamp(third.header.stamp) - seconds_from_stamp(second.header.stamp)
            assert gap == pytest.approx(0.05)

    def test_who_comes_late_hears_the_tick_that_stands(self, ros_domain, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, lockstep=True) as peer:
            standing = peer.first_tick()
            with ros_helpers.own_node(ros_domain, 'late') as late:
                heard = ros_helpers.collect(late, Odometry, 'odom', qos.SENSOR)
                ros_helpers.wait_until(lambda: heard, node=late, what='the standing tick')
                assert heard[0].header.stamp == standing.header.stamp

    def test_contact_comes_before_the_tick_it_happened_in(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, lockstep=True, start_x=4.85) as peer:
            peer.first_tick(Pose(0.0, 4.85, 0.875, 0.0))
            for _ in range(10):
                last = peer.drive([(0.2, 0.0)])
                if last.twist.twist.linear.x == 0.0:
                    break
            assert pose_from_odometry(last).x == pytest.approx(5.0 - 0.105, abs=1e-6)
            peer.wait(lambda: any(contact.data for contact in peer.of(Bool)), 'the contact')
            peer.drive([(-0.2, 0.0)])
            peer.wait(lambda: not peer.of(Bool)[-1].data, 'the end of the contact')
            assert peer.process.stderr.count('collision') == 1


class TestRealTime:
    def test_a_stale_command_stops_the_robot(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False, speed_factor=5.0) as peer:
            peer.odometry()
            peer.command(0.2, 0.0)
            peer.wait(lambda: any(o.twist.twist.linear.x == 0.2 for o in peer.of(Odometry)),
                      'motion')
            peer.wait(lambda: peer.of(Odometry)[-1].twist.twist.linear.x == 0.0, 'the stop')
            assert pose_from_odometry(peer.odometry()).x == pytest.approx(0.725, abs=0.03)
            assert peer.process.stderr.count('no command for 0.5 s') == 1

    def test_time_runs_by_itself_and_by_its_factor(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False, speed_factor=20.0) as peer:
            first = peer.odometry()
            last = peer.odometry()
            assert seconds_from_stamp(last.header.stamp) > seconds_from_stamp(first.header.stamp)
            assert seconds_from_stamp(last.header.stamp) < 1e6

    def test_without_a_clock_stamps_are_the_systems(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False, publish_clock=False) as peer:
            stamp = seconds_from_stamp(peer.odometry().header.stamp)
            now = ros_node.get_clock().now().nanoseconds * 1e-9
            assert abs(now - stamp) < 10.0
            assert not ros_node.get_publishers_info_by_topic('/clock')

    def test_sim_time_is_not_waited_for(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False, use_sim_time=True) as peer:
            peer.odometry()

    def test_stamped_commands_by_parameter(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, enable_stamped_cmd_vel=True) as peer:
            peer.command(0.0, 1.0)
            peer.wait(lambda: peer.of(Odometry) and peer.of(Odometry)[-1].twist.twist.angular.z,
                      'a turn')

    def test_a_command_that_is_too_old_does_not_move_the_robot(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, enable_stamped_cmd_vel=True) as peer:
            now = ros_node.get_clock().now().to_msg()
            old = Time(sec=now.sec - 3600)
            for _ in range(5):
                peer.command(0.0, 1.0, old)
                assert peer.odometry().twist.twist.angular.z == 0.0
            peer.wait(lambda: 'must be at most cmd_vel_timeout' in peer.process.stderr, 'the age')
            peer.command(0.0, 1.0, ros_node.get_clock().now().to_msg())
            peer.wait(lambda: peer.of(Odometry)[-1].twist.twist.angular.z, 'a turn')

    def test_a_peer_of_the_other_type_is_told_which_parameter_to_set(
            self, ros_domain, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False) as peer, \
                ros_helpers.own_node(ros_domain, 'other') as other:
            other.create_publisher(TwistStamped, 'cmd_vel', qos.COMMAND)
            peer.wait(lambda: 'set enable_stamped_cmd_vel:=true' in peer.process.stderr,
                      'the hint')

    def test_two_robots_in_namespaces(self, ros_domain, ros_node, tmp_path):
        with ros_helpers.start_node('sim_node.node', tmp_path, namespace='/a') as first:
            with ros_helpers.start_node('sim_node.node', tmp_path, namespace='/b') as second:
                here = Peer(ros_node, first, False, 'a/')
                there = Peer(ros_node, second, False, 'b/')
                for _ in range(10):
                    here.command(0.2, 0.0)
                    here.odometry()
                assert pose_from_odometry(here.odometry()).x > 0.65
                assert pose_from_odometry(there.odometry()).x == 0.625


class TestHostileInput:
    def test_commands_that_are_not_finite_move_nothing(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False) as peer:
            for v, w in 10 * ((math.nan, 0.0), (0.0, math.inf), (-math.inf, 1.0)):
                peer.command(v, w)
                after = peer.odometry()
            peer.wait(lambda: 'refused' in peer.process.stderr, 'the refusal')
            assert pose_from_odometry(after).x == 0.625
            assert after.twist.twist.angular.z == 0.0
            assert 'Traceback' not in peer.process.stderr
            # Throttled by time: how often it is said is up to the machine's load.
            assert peer.process.stderr.count('refused') < 15

    @pytest.mark.parametrize(('change', 'word'), [
        (lambda m: setattr(m.pose.pose.position, 'x', math.nan), 'finite'),
        (lambda m: setattr(m.pose.pose.orientation, 'w', 0.0), 'quaternion'),
        (lambda m: setattr(m.pose.pose.position, 'y', 99.0), 'outside the world task1'),
        (lambda m: setattr(m.pose.pose.position, 'x', 2.2), 'obstacle'),
        (lambda m: setattr(m.header, 'frame_id', 'moon'), 'moon'),
        (lambda m: setattr(m.header.stamp, 'sec', -5), 'stamp')])
    def test_initialpose(self, ros_node, tmp_path, change, word):
        with simulator(ros_node, tmp_path, stamped=False, world='task1') as peer:
            msg = initialpose_from_pose(START)
            change(msg)
            peer.places.publish(msg)
            peer.wait(lambda: word in peer.process.stderr, 'the refusal')
            assert pose_from_odometry(peer.odometry()).x == 0.625
            peer.place(Pose(0.0, 1.0, 1.0, 2.0))
            peer.wait(lambda: pose_from_odometry(peer.odometry()).x == 1.0, 'the new place')
            assert pose_from_odometry(peer.odometry()).yaw == pytest.approx(2.0)


class TestParameters:
    def test_another_world_at_run_time(self, ros_node, tmp_path):
        maps = ros_helpers.collect(ros_node, OccupancyGrid, 'map', qos.LATCHED)
        with simulator(ros_node, tmp_path, lockstep=True) as peer:
            peer.wait(lambda: maps, 'the map')
            before = peer.first_tick()
            assert not occupancy_from_map(maps[0])[1].any()
            assert set_parameters(ros_node, world='task1')[0].successful
            peer.wait(lambda: len(maps) == 2, 'the new map')
            grid, occupancy = occupancy_from_map(maps[1])
            assert grid == GRID
            np.testing.assert_array_equal(
                occupancy, load_world(find_world('task1')).occupancy)
            peer.wait(lambda: peer.of(Odometry)[-1].header.stamp != before.header.stamp,
                      'the tick that shows it')

    def test_wrong_values_are_refused_with_their_range(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False, listen=False):
            (tmp_path / 'bad.yaml').write_text('nonsense')
            for name, value, words in (
                    ('world', 'nowhere', ['open, task1, task2']),
                    ('world', str(tmp_path / 'bad.yaml'), ['bad.yaml']),
                    ('movers', 'nowhere', ['crossing, door']),
                    ('movers', str(tmp_path / 'bad.yaml'), ['bad.yaml', 'movers and changes']),
                    ('slip', 0.7, ['slip', '0.0', '0.5']),
                    ('slip', math.nan, ['slip', '0.0', '0.5']),
                    ('speed_factor', 0.0, ['speed_factor', '0.01', '100']),
                    ('seed', -1, ['seed', '0']), ('slip', 'much', ['slip', 'float']),
                    ('rate', 10.0, ['rate', 'read-only'])):
                result, = set_parameters(ros_node, **{name: value})
                assert not result.successful
                for word in words:
                    assert word in result.reason
            assert set_parameters(ros_node, speed_factor=2.0, slip=0.1)[1].successful
            values = ros_helpers.call(
                ros_node, GetParameters, '/sim_node/get_parameters',
                GetParameters.Request(names=['world', 'slip', 'speed_factor'])).values
            assert values[0].string_value == 'open'
            assert [v.double_value for v in values[1:]] == [0.1, 2.0]

    def test_descriptions_tell_meaning_unit_and_range(self, ros_node, tmp_path):
        with simulator(ros_node, tmp_path, stamped=False, listen=False):
            described, = ros_helpers.call(
                ros_node, DescribeParameters, '/sim_node/describe_parameters',
                DescribeParameters.Request(names=['heading_drift'])).descriptors
            assert 'rad/m' in described.description
            assert described.floating_point_range[0].to_value == 1.0


def test_reset_and_diagnostics(ros_node, tmp_path):
    reports = ros_helpers.collect(ros_node, DiagnosticArray, '/diagnostics')
    with simulator(ros_node, tmp_path, lockstep=True, start_x=4.87) as peer:
        peer.first_tick(Pose(0.0, 4.87, 0.875, 0.0))
        peer.drive([(0.2, 0.0)] * 4)

        def last():
            return {v.key: v.value for v in reports[-1].status[0].values} if reports else {}
        peer.wait(lambda: last().get('contact') == 'true', 'the report')
        assert last()['collisions'] == '1'
        assert last()['world'] == 'open'
        assert reports[-1].status[0].level == b'\x02'
        answer = ros_helpers.call(
            ros_node, Trigger, '/sim_node/reset', again=ros_helpers.REPEAT)
        assert answer.success
        peer.wait(lambda: last()['contact'] == 'false', 'the report')
        peer.wait(lambda: pose_from_odometry(peer.of(Odometry)[-1]).x == 4.87, 'the reset')
        assert set_parameters(ros_node, start_x=-3.0)[0].successful
        answer = ros_helpers.call(
            ros_node, Trigger, '/sim_node/reset', again=ros_helpers.REPEAT)
        assert not answer.success
        assert 'start_x' in answer.message


class TestProcess:
    def start(self, folder, *arguments):
        command = ros_helpers.node_command('sim_node.node', folder)
        return ros_helpers.run([*command, '--ros-args', *arguments], folder)

    @pytest.mark.parametrize(('argument', 'word'), [
        ('world:=nowhere', 'open, task1, task2'), ('world:=/nowhere.yaml', '/nowhere.yaml'),
        ('world:=/', '/: '), ('rate:=0.1', 'rate'), ('slip:=much', 'slip'),
        ('start_x:=-4.0', 'start_x'), ('seed:=-1', 'seed')])
    def test_mistakes_are_one_line_and_exit_code_2(self, quiet_domain, tmp_path, argument, word):
        process = self.start(tmp_path, '-p', argument)
        assert process.popen.returncode == 2
        assert process.stdout == ''
        line, = process.stderr.splitlines()
        assert line.startswith('sim_node: ')
        assert word in line

    def test_malformed_map(self, quiet_domain, tmp_path):
        path = tmp_path / 'map.yaml'
        path.write_text('image: map.pgm\nresolution: .nan\norigin: [0, 0, 0]\n')
        (tmp_path / 'map.pgm').write_bytes(b'P5 1 1 255\n\xfe')
        process = self.start(tmp_path, '-p', f'world:={path}')
        assert process.popen.returncode == 2
        line, = process.stderr.splitlines()
        assert str(path) in line
        assert 'resolution' in line

    @pytest.mark.parametrize('arguments', [('-p', 'a'), ('--nonsense',), ('-r', '__node:=a-b')])
    def test_wrong_ros_arguments(self, quiet_domain, tmp_path, arguments):
        process = self.start(tmp_path, *arguments)
        assert process.popen.returncode == 2
        assert 'Traceback' not in process.stderr
        assert 'sim_node: wrong ROS arguments' in process.stderr

    @pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
    @pytest.mark.parametrize('lockstep', [True, False])
    def test_signals_end_it_well(self, ros_node, tmp_path, number, lockstep):
        with simulator(ros_node, tmp_path, lockstep, lockstep=lockstep) as peer:
            peer.first_tick()
            peer.process.stop(number)
            [line] = peer.process.stderr.splitlines()
            assert 'world open, 20 x 20 cells of 0.25 m' in line
            assert ('in lock-step' if lockstep else 'in real time x 1;') in line
            assert 'on /cmd_vel' in line
            assert peer.process.stdout == ''
