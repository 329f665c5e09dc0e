"""How a robot drives: its wheels, and what its simulator or its controller says of them."""

from collections.abc import Iterator
import math
from pathlib import Path
import re
from typing import Any, Final, NamedTuple

import numpy as np

from experience_cli.errors import UserError
from experience_cli.robot.facts import Facts
from experience_cli.robot.urdf import Description, Floats, Joint

#: Words in the names of simulators' plugins: two wheels, or wheels on two sides; and others.
_DIFFERENTIAL: Final = ('diff_drive', 'diffdrive', 'diff-drive', 'skid_steer')
_OTHERS: Final = {
    r'planar_?move': 'moves in any direction', r'mecanum': 'moves in any direction',
    r'^omni(_\w)?(\.\w+)?$|omni_?(wheel|drive|direction)': 'moves in any direction',
    r'ackermann|tricycle|bicycle|steering': 'steers its wheels'}
#: What plugins call it, without underscores and in lower case: our name, and what to multiply by.
_NUMBERS: Final = {
    'wheelseparation': ('wheel_separation', 1.0), 'wheelradius': ('wheel_radius', 1.0),
    'wheeldiameter': ('wheel_radius', 0.5), 'maxwheelacceleration': ('a_max', 1.0),
    'wheelacceleration': ('a_max', 1.0), 'maxlinearvelocity': ('v_max', 1.0),
    'maxlinearacceleration': ('a_max', 1.0), 'minlinearacceleration': ('a_max', 1.0),
    'maxangularvelocity': ('w_max', 1.0), 'maxangularacceleration': ('alpha_max', 1.0),
    'minangularacceleration': ('alpha_max', 1.0)}
_NAMES: Final = {'robotbaseframe': 'base_frame', 'childframeid': 'base_frame',
                 'odometryframe': 'odom_frame', 'frameid': 'odom_frame'}
#: How far the axis of a wheel may be from level and straight across, as a cosine.
_ACROSS: Final = 0.95


class Wheel(NamedTuple):
    """A wheel that rolls ahead: its joint, and where it is in the frame of the robot's middle."""

    joint: Joint
    at: Floats


def check_drive(word: str, where: str) -> None:
    """
    Refuse what drives otherwise than by wheels on two sides.

    Parameters
    ----------
    word : str
        The name of a plugin, a controller or a model of motion.
    where : str
        Where it stands, for the message.

    Raises
    ------
    UserError
        If it does.

    """
    plain = word.lower()
    found = next((what for key, what in _OTHERS.items() if re.search(key, plain)), None)
    if found is not None and not any(each in plain for each in _DIFFERENTIAL):
        raise UserError(f'{where}: {word} {found}; only robots with a differential drive (wheels '
                        f'on two sides) can be taught')


def plugins_in(robot: Description) -> Iterator[tuple[str, Any]]:
    """Yield the simulators' plugins of a robot: both of their names, and the element."""
    for plugin in robot.tree.iter('plugin'):
        yield f'{plugin.get("name", "")} {plugin.get("filename", "")}'.strip(), plugin


def add_plugins(robot: Description, facts: Facts) -> None:
    """
    Note what the plugin says that drives the robot in a simulator.

    Raises
    ------
    UserError
        If it is not driven by wheels on two sides.

    """
    for name, plugin in plugins_in(robot):
        check_drive(name, str(robot.path))
        if not any(each in name.lower() for each in _DIFFERENTIAL):
            continue
        for element in plugin:
            key, text = str(element.tag).lower().replace('_', ''), (element.text or '').strip()
            source = f'plugin {plugin.get("name", name)}, {element.tag}'
            if key in _NAMES:
                facts.add(_NAMES[key], text.lstrip('/') or None, source)
            elif key in _NUMBERS:
                ours, factor = _NUMBERS[key]
                facts.add_positive(ours, _number(robot.path, source, text) * factor, source)


def _number(path: Path, source: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UserError(f'{path}: {source} is {text[:60]!r}, must be a number') from None


def wheels_of(robot: Description, base: str) -> list[Wheel]:
    """
    Return the wheels that roll ahead; casters, which turn about an upright axis, are left out.

    Raises
    ------
    UserError
        If a wheel is steered, or looks another way than ahead.

    """
    wheels = []
    for joint in robot.joints.values():
        if joint.kind != 'continuous' and 'wheel' not in joint.name.lower():
            continue
        if joint.kind not in ('continuous', 'revolute') or _is_idle(robot, joint):
            continue
        place = robot.place(joint.child, base)
        axis = place[:3, :3] @ joint.axis
        axis /= np.linalg.norm(axis) or 1.0
        if abs(axis[2]) > 0.5:
            continue  # it turns about an upright axis: no wheel, or what holds one
        _check_wheel(robot, joint, axis)
        wheels.append(Wheel(joint, place[:3, 3]))
    return wheels


def _is_idle(robot: Description, joint: Joint) -> bool:
    """Return whether a wheel is a caster's, or no wheel by its name."""
    words = f'{joint.name} {joint.child}'.lower()
    return 'caster' in words or 'castor' in words or not (
        'wheel' in words or any(shape.kind in ('cylinder', 'sphere', 'mesh')
                                for shape in robot.collisions[joint.child]))


def _check_wheel(robot: Description, joint: Joint, axis: Floats) -> None:
    holder = next((each for each in robot.above(joint.parent)
                   if 'steer' in each.name.lower() and each.kind in ('revolute', 'continuous')),
                  None)
    if holder is not None:
        raise UserError(f'{robot.path}: joint {holder.name} steers the wheel {joint.child}; only '
                        f'robots with a differential drive (wheels on two sides) can be taught')
    for shape in [*robot.collisions[joint.child], *robot.visuals[joint.child]]:
        check_drive(shape.attributes.get('filename', '').rpartition('/')[2],
                    f'{robot.path}: wheel {joint.child}')
    if 'wheel' in f'{joint.name} {joint.child}'.lower() and abs(axis[1]) < _ACROSS:
        raise UserError(
            f'{robot.path}: the wheel of joint {joint.name} does not roll straight ahead (its '
            f'axis is {np.round(axis, 2).tolist()}); only robots with a differential drive '
            f'(wheels on two sides) can be taught')


def add_wheels(robot: Description, base: str, facts: Facts) -> None:
    """Note how far the wheels of both sides are apart, how large they are, how fast they turn."""
    wheels = wheels_of(robot, base)
    left, right = ([wheel for wheel in wheels if sign * wheel.at[1] > 1e-3] for sign in (1, -1))
    if not left or not right:
        facts.notes.append(
            'no wheels are found on both sides (joints of type continuous whose axis lies across '
            'the robot): what is said of them is a default')
        return
    apart = float(np.mean([wheel.at[1] for wheel in left])
                  - np.mean([wheel.at[1] for wheel in right]))
    names = ', '.join(wheel.joint.name for wheel in [*left, *right][:4])
    facts.add_positive('wheel_separation', round(apart, 4), f'joints {names}')
    if len(left) + len(right) > 2:
        facts.notes.append('it has more than two wheels, which slip when it turns: a localisation '
                           '(pose_topic) keeps its odometry true')
    middle = float(np.mean([wheel.at[0] for wheel in [*left, *right]]))
    if abs(middle) > 0.02:
        facts.notes.append(f'its wheels are {middle:.3f} m ahead of {base!r}: it turns about '
                           f'another point than the one that odometry is taken to be of')
    add_wheel_size(robot, left + right, facts)


def add_wheel_size(robot: Description, wheels: list[Wheel], facts: Facts) -> None:
    """Note the radius of the wheels, and how fast they drive the robot at most."""
    for wheel in wheels:
        for shape in [*robot.collisions[wheel.joint.child], *robot.visuals[wheel.joint.child]]:
            try:
                radius = float(shape.attributes.get('radius', 'nan'))
            except ValueError:
                continue
            if math.isfinite(radius):
                facts.add_positive('wheel_radius', radius, f'{shape.kind} of {wheel.joint.child}')
                break
    radius_found = facts.first('wheel_radius')
    for wheel in wheels if radius_found else ():
        if wheel.joint.velocity is not None and radius_found:
            facts.add_positive('v_max', round(wheel.joint.velocity * radius_found.value, 3),
                               f'joint {wheel.joint.name}, limit velocity times the wheel radius')
            return
