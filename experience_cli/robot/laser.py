"""The laser of a robot: which of its links, where it sits, how far it sees."""

from collections.abc import Iterator
import math
import re
from typing import Any, Final, NamedTuple

from experience_cli.errors import UserError
from experience_cli.robot.facts import Facts
from experience_cli.robot.urdf import Description
from msgs_bridge.sensing.laser_mount import Mount, mount_from_transform

_KINDS: Final = ('ray', 'gpu_ray', 'lidar', 'gpu_lidar')
#: Simulated rays are no laser scanner if they are fewer, or look at less, [rad]: cliff and bump
#: sensors are such.
_LEAST_RAYS, _LEAST_ANGLE = 45, 1.0
#: Names of links that are lasers where no sensor says so.
_NAMES: Final = re.compile(
    r'(^|_|/)(base_scan|laser|lidar|scan|rplidar|lds|hokuyo|velodyne|ouster|sick)(_|\d|$)')


class Laser(NamedTuple):
    """
    A laser.

    Parameters
    ----------
    link : str
    source : str
        What says that it is one.
    reach : float or None, [m]
        How far it sees.
    topic : str
        Of its scans; empty where nothing says it.
    n_rows : int
        Rows of rays, one above the other.

    """

    link: str
    source: str
    reach: float | None = None
    topic: str = ''
    n_rows: int = 1


def add_laser(robot: Description, base: str, wanted: str | None, facts: Facts) -> None:
    """
    Note where the laser sits, and what it sees.

    Parameters
    ----------
    robot : Description
    base : str
        The link that the robot's middle is.
    wanted : str or None
        The link that a person named.
    facts : Facts

    Raises
    ------
    UserError
        If there are several and nobody said which, the one named is no link, or it is tilted.

    """
    laser = _chosen(robot, wanted)
    if laser is None:
        facts.notes.append(
            'no laser is found: without one, or a costmap (source: costmap), the robot can be '
            'taught but sees nothing to avoid; --laser LINK names one that is called otherwise')
        return
    mount = mount_from_transform(robot.place(laser.link, base))
    floor = robot.place(laser.link, 'base_footprint' if 'base_footprint' in robot.collisions
                        else base)[2, 3]
    mount = Mount(round(mount.x, 5), round(mount.y, 5), _plain(mount.yaw),
                  round(max(float(floor), 0.0), 5), _plain(mount.roll), _plain(mount.pitch))
    if mount.problem:
        raise UserError(f'{robot.path}: {laser.link}: {mount.problem}')
    joints = [joint.name for joint in robot.above(laser.link)]
    facts.add('laser', mount, f'{laser.link} ({laser.source}), through {", ".join(joints[:6])}')
    facts.add('laser_frame', laser.link, laser.source)
    facts.add_positive('sight_range', laser.reach, f'sensor of {laser.link}, range max')
    facts.add('scan_topic', laser.topic.lstrip('/') or None, f'sensor of {laser.link}')
    if laser.n_rows > 1:
        facts.notes.append(f'{laser.link} has {laser.n_rows} rows of rays: its points have to '
                           f'become a LaserScan first (pointcloud_to_laserscan)')


def _plain(value: float) -> float:
    """Return an angle, [rad]; what is a quarter turn or several, but for rounding, exactly."""
    quarters = round(value / (math.pi / 2.0))
    if abs(value - quarters * math.pi / 2.0) < 2e-3:
        return abs(quarters) * math.pi / 2.0 if abs(quarters) == 2 else quarters * math.pi / 2.0
    return round(value, 5)


def _chosen(robot: Description, wanted: str | None) -> Laser | None:
    sensors = list(_sensors(robot))
    if wanted is not None:
        if wanted not in robot.collisions:
            raise UserError(f'{robot.path}: --laser {wanted}: there is no such link; there are: '
                            f'{", ".join(sorted(robot.collisions)[:30])}')
        return next((each for each in sensors if each.link == wanted), Laser(wanted, '--laser'))
    found = sensors or [Laser(link, 'by its name') for link in _by_name(robot)]
    if len(found) > 1:
        raise UserError(
            f'{robot.path}: has several lasers: {", ".join(each.link for each in found)}; name '
            f'with --laser the one whose scans are to be read (one topic is: laser_merger or the '
            f'like can put several together)')
    return found[0] if found else None


def _sensors(robot: Description) -> Iterator[Laser]:
    """Yield the lasers that simulators are told of, one a link."""
    seen = set()
    for gazebo in robot.tree.findall('gazebo'):
        for sensor in gazebo.iter('sensor'):
            link = _frame(robot, gazebo, sensor)
            if link in seen or link not in robot.collisions or not _is_laser(sensor):
                continue
            seen.add(link)
            yield Laser(str(link), f'sensor {sensor.get("name", "")}',
                        _value(sensor, 'range/max'), _topic(sensor),
                        int(_value(sensor, 'scan/vertical/samples') or 1))


def _frame(robot: Description, gazebo: Any, sensor: Any) -> str | None:
    """Return the link of a sensor's scans: the one it says, else the one it belongs to."""
    names = [element.text.strip().lstrip('/') for element in sensor.iter() if element.text
             and str(element.tag).lower().replace('_', '') in (
                 'framename', 'gzframeid', 'ignitionframeid')]
    reference: str | None = gazebo.get('reference')
    return next((name for name in names if name in robot.collisions), reference)


def _is_laser(sensor: Any) -> bool:
    low, high = (_value(sensor, f'scan/horizontal/{end}_angle') or 0.0 for end in ('min', 'max'))
    n = _value(sensor, 'scan/horizontal/samples') or 0.0
    return sensor.get('type') in _KINDS and n >= _LEAST_RAYS and high - low >= _LEAST_ANGLE


def _value(sensor: Any, name: str) -> float | None:
    """Return a number inside a sensor's <ray> or <lidar>; None where there is none."""
    for element in (sensor.find(f'ray/{name}'), sensor.find(f'lidar/{name}')):
        try:
            return float(element.text)
        except (AttributeError, TypeError, ValueError):
            continue
    return None


def _topic(sensor: Any) -> str:
    """Return the topic of a sensor's scans; empty where nothing says it."""
    for element in sensor.iter():
        words = (element.text or '').strip()
        if element.tag in ('topic', 'topicName', 'topic_name'):
            return words
        if element.tag == 'remapping' and words.startswith('~/out:='):
            return words.removeprefix('~/out:=')
    return ''


def _by_name(robot: Description) -> list[str]:
    """Return the links that are called like lasers; of one mounted on another the upper one."""
    links = [link for link in robot.collisions if _NAMES.search(link.lower())]
    held = {joint.parent for link in links for joint in robot.above(link)}
    return [link for link in links if link not in held]
