import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
import yaml

from control_field.robot.footprint import footprint_from_text
from experience_cli.main import main
import robot_files
from robot_files import (
    BASE, BOX, BOX_ROBOT, CLIFF, CONTROLLER, DIFF_DRIVE, LASER, NAV2, ROUND, urdf, WHEELS)
from robot_parameters import check_parameters


@pytest.fixture
def written(tmp_path, capsys):
    """Return a function that runs the command, and gives its values, text and notes."""
    def run(source, content, *options, **files):
        path = tmp_path / ('robot.urdf' if source == 'from-urdf' else 'params.yaml')
        path.write_text(content)
        for name, text in files.items():
            (tmp_path / f'{name}.yaml').write_text(text)
            options = (*options, *(['--params'] if source == 'from-urdf' else []),
                       str(tmp_path / f'{name}.yaml'))
        assert main(['robot', source, str(path), *options]) == 0
        output = capsys.readouterr()
        sections = yaml.safe_load(output.out)
        values = {node.rpartition('/')[2]: section['ros__parameters']
                  for node, section in sections.items()}
        check_parameters(values)
        return values, output.out, output.err

    return run


def refusal(tmp_path, capsys, source, content, *options):
    path = tmp_path / 'file'
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert main(['robot', source, str(path), *options]) == 2
    error = capsys.readouterr().err
    assert error.count('\n') == 1
    return error


class TestUrdf:
    def test_body_wheels_and_laser_through_the_joints(self, written):
        values, text, notes = written('from-urdf', BOX_ROBOT)
        sight, drive = values['neighbourhood_node'], values['control_field_node']
        outline = footprint_from_text(sight['footprint'])
        assert sorted(outline.corners) == [
            (-0.25, -0.2), (-0.25, 0.2), (0.35, -0.2), (0.35, 0.2)]
        assert sight['robot_radius'] == pytest.approx(math.hypot(0.35, 0.2), abs=1e-3)
        assert drive['robot_radius'] == sight['robot_radius']
        assert drive['footprint'] == sight['footprint']
        mount = [sight[f'laser_{name}'] for name in ('x', 'y', 'z', 'roll', 'pitch', 'yaw')]
        assert mount == pytest.approx([0.2, 0.1, 0.3, math.pi, 0.0, math.pi / 2], abs=1e-4)
        assert sight['sight_range'] == 8.0
        assert (drive['wheel_separation'], drive['v_max'], drive['w_max'], drive['a_max']) == (
            0.35, 0.6, 1.8, 1.2)
        assert drive['base_frame_id'] == 'base_footprint'
        assert sight['frame_id'] == values['learner_node']['frame_id'] == 'robot_odom'
        assert 'scan:=front/scan' in text
        assert notes == ''

    def test_each_value_says_where_it_is_from(self, written):
        _, text, _ = written('from-urdf', BOX_ROBOT)
        words = ' '.join(text.replace('#', ' ').split())
        assert ('limit velocity times the wheel radius; more is said: 0.8 by plugin gz::sim::'
                'systems::DiffDrive, max_linear_velocity v_max: 0.6') in words
        for said in ('collision geometry of base_link', 'min_linear_acceleration; more is',
                     'laser (sensor lidar), through laser_joint, mast_joint, base_joint',
                     'TO BE CHECKED, no file says it: a gentle one alpha_max: 1.0'):
            assert said in words

    def test_a_round_robot_is_a_disc(self, written):
        values, _, _ = written('from-urdf', urdf(ROUND, WHEELS))
        assert values['control_field_node']['robot_radius'] == pytest.approx(0.2, abs=2e-3)
        assert values['control_field_node']['robot_radius'] >= 0.2
        assert 'footprint' not in values['control_field_node']
        assert values['control_field_node']['wheel_separation'] == 0.34

    def test_without_a_laser_it_says_what_works(self, written):
        values, text, notes = written('from-urdf', urdf(BASE, BOX, WHEELS, CLIFF, DIFF_DRIVE))
        assert 'no laser is found' in notes
        assert 'NOTE: no laser is found' in text
        assert 'laser_x' not in values['neighbourhood_node']

    def test_a_laser_may_be_known_by_its_name_or_named(self, written):
        bare = LASER[:LASER.index('<gazebo')]
        values, _, _ = written('from-urdf', urdf(BASE, BOX, WHEELS, bare))
        assert values['neighbourhood_node']['laser_y'] == pytest.approx(0.1)
        values, _, _ = written('from-urdf', BOX_ROBOT, '--laser', 'mast')
        assert values['neighbourhood_node']['laser_yaw'] == pytest.approx(math.pi / 2, abs=1e-4)

    def test_the_middle_may_be_another_link(self, written):
        ahead = BOX_ROBOT.replace('xyz="0 0 0.05"', 'xyz="0.1 0 0.05"')
        reach = {base: footprint_from_text(written('from-urdf', ahead, '--base-frame', base)[0][
            'control_field_node']['footprint']).circumscribed
            for base in ('base_footprint', 'base_link')}
        assert reach == pytest.approx({'base_footprint': math.hypot(0.45, 0.2),
                                       'base_link': math.hypot(0.35, 0.2)}, abs=2e-3)

    def test_more_than_two_wheels_slip(self, written):
        rear = WHEELS.replace('left_wheel', 'rear_left_wheel').replace(
            'right_wheel', 'rear_right_wheel').replace('xyz="0 ', 'xyz="-0.2 ')
        front = WHEELS.replace('xyz="0 ', 'xyz="0.2 ')
        values, _, notes = written('from-urdf', urdf(BASE, BOX, front, rear))
        assert 'slip when it turns' in notes
        assert values['control_field_node']['wheel_separation'] == 0.34

    def test_what_software_lets_wheels_do_is_not_believed(self, written):
        values, _, _ = written('from-urdf', BOX_ROBOT.replace('>1.5<', '>20<').replace(
            '>-1.2<', '>-20<'))
        assert values['control_field_node']['a_max'] == 3.0

    def test_a_value_out_of_our_range_is_cut_and_said(self, written):
        values, _, notes = written('from-urdf', BOX_ROBOT.replace('>1.8<', '>30<'))
        assert values['control_field_node']['w_max'] == 20.0
        assert 'w_max is 30' in notes


class TestParameterFiles:
    def test_nav2(self, written):
        values, text, _ = written('from-nav2', NAV2)
        drive = values['control_field_node']
        assert (drive['v_max'], drive['w_max'], drive['a_max'], drive['alpha_max']) == (
            0.5, 1.9, 2.0, 3.2)
        assert footprint_from_text(drive['footprint']).inscribed == pytest.approx(0.2)
        assert values['teleop_node']['enable_stamped_cmd_vel'] is True
        assert values['neighbourhood_node']['sight_range'] == 6.0
        assert 'scan:=front/scan' in text
        assert 'controller_server, FollowPath.vx_max' in ' '.join(text.split())

    def test_a_controller_counts_before_the_joints(self, written):
        values, text, _ = written('from-urdf', BOX_ROBOT, controller=CONTROLLER)
        drive = values['control_field_node']
        assert drive['wheel_separation'] == pytest.approx(0.51)
        assert drive['cmd_vel_timeout'] == 0.25
        assert drive['a_max'] == 1.2
        assert 'base_controller, wheel_separation' in text

    def test_an_outline_counts_before_a_radius_that_is_too_small(self, written):
        radius = 'local_costmap: {local_costmap: {ros__parameters: {robot_radius: 0.22}}}'
        values, _, notes = written('from-urdf', BOX_ROBOT, nav2=radius)
        assert values['control_field_node']['robot_radius'] > 0.4
        assert 'local_costmap, robot_radius is 0.22 m' in notes
        values, _, _ = written('from-nav2', NAV2, wheels=CONTROLLER)
        assert values['control_field_node']['wheel_separation'] == pytest.approx(0.51)

    def test_amcl_with_another_model_is_said(self, written):
        _, _, notes = written('from-nav2', NAV2.replace(
            'scan_topic: scan}', 'robot_model_type: "nav2_amcl::OmniMotionModel"}'))
        assert 'DifferentialMotionModel' in notes


def facets():
    """Return the corners of a pyramid 0.5 m long and 0.3 m wide, as triangles."""
    base = [(0.25, 0.15, 0), (-0.25, 0.15, 0), (-0.25, -0.15, 0), (0.25, -0.15, 0)]
    return [(base[i - 1], base[i], (0.0, 0.0, 0.4)) for i in range(4)]


def stl(is_binary):
    if is_binary:
        kind = np.dtype([('n', '<f4', 3), ('c', '<f4', (3, 3)), ('m', '<u2')])
        table = np.zeros(4, kind)
        table['c'] = facets()
        return b'solid, as some binary files begin'.ljust(80) + (4).to_bytes(
            4, 'little') + table.tobytes()
    vertices = ['\n'.join('vertex {} {} {}'.format(*corner) for corner in each)
                for each in facets()]
    return 'solid a\n{}\nendsolid a\n'.format('\n'.join(
        f'facet normal 0 0 0\nouter loop\n{each}\nendloop\nendfacet'
        for each in vertices)).encode()


def collada():
    """Return the same in centimetres, and lying on its side until its node turns it."""
    numbers = ' '.join(f'{100 * x} {100 * z} {-100 * y}' for each in facets() for x, y, z in each)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="36">{numbers}
</float_array></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices></mesh>
</geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><rotate>1 0 0 90</rotate>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes></COLLADA>
""".encode()


class TestMeshes:
    @pytest.mark.parametrize(('name', 'content'), [
        ('body.stl', stl(True)), ('body.STL', stl(False)), ('body.dae', collada()),
        ('body.obj', '\n'.join('v {} {} {}'.format(*corner) for each in facets()
                               for corner in each).encode())])
    @pytest.mark.parametrize('scheme', ['package://small_description/meshes/', '../meshes/'])
    def test_their_points_are_the_outline(self, tmp_path, capsys, name, content, scheme):
        for folder in ('urdf', 'meshes'):
            (tmp_path / 'small_description' / folder).mkdir(parents=True)
        path = tmp_path / 'small_description/urdf/robot.urdf'
        path.write_text(urdf(BOX.replace(
            '<box size="0.6 0.4 0.2"/>', f'<mesh filename="{scheme}{name}" scale="2 1 1"/>')))
        (tmp_path / 'small_description/meshes' / name).write_bytes(content)
        assert main(['robot', 'from-urdf', str(path)]) == 0
        sections = yaml.safe_load(capsys.readouterr().out)
        outline = footprint_from_text(
            sections['/**/control_field_node']['ros__parameters']['footprint'])
        assert np.ptp(outline.corners, axis=0) == pytest.approx([1.0, 0.3], abs=3e-3)

    def test_one_that_is_not_there_is_said(self, written):
        mesh = BOX.replace('</link>', '<collision><geometry><mesh filename="package://a/b.stl"/>'
                           '</geometry></collision></link>')
        _, text, notes = written('from-urdf', urdf(mesh, WHEELS))
        assert 'base_link: package://a/b.stl is left out' in notes
        assert '--packages FOLDER' in text

    def test_without_any_body_the_radius_is_a_guess_that_is_said(self, written):
        _, text, notes = written('from-urdf', urdf('<link name="base_link"/>'))
        assert 'has no body' in notes
        assert 'TO BE CHECKED, no file says it: a guess' in text


BOMB = '<!DOCTYPE lolz [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
TWO_LASERS = LASER + LASER.replace('laser', 'back_laser').replace('mast', 'back_mast')
STEERED = WHEELS.replace('<parent link="base_link"/>', '<parent link="knuckle"/>') + """
  <link name="knuckle"/>
  <joint name="front_steering_joint" type="revolute">
    <parent link="base_link"/><child link="knuckle"/><axis xyz="0 0 1"/>
  </joint>"""


class TestRefusals:
    @pytest.mark.parametrize(('content', 'said'), [
        ('<robot name="a"><link', 'is no XML'), ('', 'is no XML'),
        (BOMB + '<robot name="a"><link name="&b;"/></robot>', '<!DOCTYPE>'),
        ('<sdf version="1.9"/>', 'it is SDF'), ('<html/>', 'it is of <html>'),
        ('<robot name="a"/>', 'has no <link>'),
        (urdf('<xacro:include filename="a"/>').replace(
            '<robot', '<robot xmlns:xacro="http://ros.org/wiki/xacro"'), '`xacro '),
        ('<robot><xacro:a/></robot>', '`xacro '), (urdf('<link name="${a}"/>'), '`xacro '),
        (urdf('<link/>'), '<link> has no name'),
        (urdf('<link name="a"/><link name="a"/>'), "two links called 'a'"),
        (urdf('<link name="a"/><link name="b"/>'), "nothing joins 'b' to 'a'"),
        (urdf(BASE), "the child 'base_link', and there is no such link"),
        (urdf(BASE, BOX, BASE[BASE.index('<joint'):].replace('base_joint', 'other')),
         'hangs on two joints'),
        (urdf(BASE, BOX, WHEELS).replace('0.17 0.01', 'nan 0.01'), 'must be 3 numbers'),
        (urdf(BASE, BOX, WHEELS).replace('0.17 0.01', '0.17'), 'must be 3 numbers'),
        (urdf(BASE, BOX).replace('0.6 0.4 0.2', 'wide'), "size='wide' must be 3 numbers"),
        (BOX_ROBOT.replace('>0.35<', '>wide<'), "'wide', must be a number"),
        (urdf(BASE, BOX, WHEELS, TWO_LASERS), 'several lasers: laser, back_laser; name with'),
        (BOX_ROBOT.replace('3.1415927 0 0', '0 0.5 0'), 'tilted by 29 degrees'),
        (BOX_ROBOT.replace('systems::DiffDrive', 'systems::MecanumDrive').replace(
            'diff-drive', 'mecanum-drive'), 'moves in any direction'),
        (BOX_ROBOT.replace('<axis xyz="0 0 1"/>', '<axis xyz="1 0 1"/>'), 'straight ahead'),
        (urdf(BASE, BOX, STEERED), 'front_steering_joint steers the wheel'),
        (NAV2, 'from-nav2'), (b'\xff\xfe\x00', 'is no XML')])
    def test_of_a_description(self, tmp_path, capsys, content, said):
        assert said in refusal(tmp_path, capsys, 'from-urdf', content)

    def test_joints_in_a_circle(self, tmp_path, capsys):
        joints = ''.join(
            f'<link name="{a}"/><joint name="{a}{b}" type="fixed"><parent link="{a}"/>'
            f'<child link="{b}"/></joint>' for a, b in ('ab', 'bc', 'ca'))
        for more in ('', '<link name="d"/>'):
            assert 'circle' in refusal(tmp_path, capsys, 'from-urdf', urdf(joints, more))

    @pytest.mark.parametrize('option', ['--laser', '--base-frame'])
    def test_of_a_link_that_is_not_there(self, tmp_path, capsys, option):
        error = refusal(tmp_path, capsys, 'from-urdf', BOX_ROBOT, option, 'lazer')
        assert 'there is no such link; there are: base_footprint, base_link' in error

    @pytest.mark.parametrize(('content', 'said'), [
        (BOX_ROBOT, 'from-urdf'), ('a: [', 'is no YAML'), ('a: &b 1\nc: *b', 'alias'),
        ('a: 1', 'says nothing of how large'), ('', 'says nothing of how large'),
        (NAV2.replace('DiffDrive', 'Omni'), 'moves in any direction'),
        (NAV2.replace('DiffDrive', 'Ackermann'), 'steers its wheels'),
        (NAV2.replace('[0.5, 0.0, 2.0]', '[0.5, 0.3, 2.0]'), 'drive sideways (0.3 m/s)'),
        (NAV2.replace('vx_min: -0.35', 'max_vel_y: 0.2'), 'drive sideways'),
        (NAV2.replace('[0.3, 0.2], [0.3,', '[0.3, 0.2], [0.3'), 'must be at least three points'),
        ('controller_manager: {ros__parameters: {a: {type: a/MecanumDriveController}}}',
         'moves in any direction')])
    def test_of_a_parameter_file(self, tmp_path, capsys, content, said):
        assert said in refusal(tmp_path, capsys, 'from-nav2', content)

    def test_of_what_is_not_there_or_cannot_be_written(self, tmp_path, capsys):
        assert main(['robot', 'from-urdf', str(tmp_path / 'no.urdf')]) == 2
        path = tmp_path / 'robot.urdf'
        path.write_text(BOX_ROBOT)
        assert main(['robot', 'from-urdf', str(path), '--output', str(tmp_path / 'a/b')]) == 2
        assert 'there is no folder' in capsys.readouterr().err

    @settings(max_examples=60)
    @given(st.data())
    def test_whatever_is_cut_out_of_a_description(self, tmp_path_factory, data):
        """No traceback, whatever a file looks like; an answer is 0 or 2."""
        text = BOX_ROBOT if data.draw(st.booleans()) else robot_files.NAV2
        low = data.draw(st.integers(0, len(text)))
        high = data.draw(st.integers(low, min(low + 60, len(text))))
        put = data.draw(st.sampled_from(
            ['', '0', '-1', '1e300', 'nan', '<', '"', '[]', 'base_link']))
        path = tmp_path_factory.mktemp('cut') / 'file'
        path.write_text(text[:low] + put + text[high:])
        source = 'from-urdf' if text is BOX_ROBOT else 'from-nav2'
        assert main(['robot', source, str(path), '--output', str(path.with_name('out'))]) in (0, 2)


def test_what_is_written_goes_into_a_file(tmp_path):
    path, out = tmp_path / 'robot.urdf', tmp_path / 'robot.yaml'
    path.write_text(urdf(BASE, BOX, WHEELS, DIFF_DRIVE))
    assert main(['robot', 'from-urdf', str(path), '--output', str(out)]) == 0
    assert '/**/learner_node' in yaml.safe_load(out.read_text())
