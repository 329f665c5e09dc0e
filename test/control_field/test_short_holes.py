"""Short holes across which speeds and headings lead, and headings that leap beside the way."""

import numpy as np
import pytest

from control_field.drives.breaks import ImplausibleDriveError
from control_field.drives.dead_reckoning import Motion
from control_field.drives.plausibility import DriveLimits, whole_drive

LIMITS = DriveLimits(0.25)


def straight(seconds=20.0, speed=0.4, rate=20.0):
    """Return stamps, places, headings with speeds of a robot that drives ahead, aside a little."""
    stamps = np.arange(0.0, seconds, 1.0 / rate)
    yaw = 0.1 * np.sin(stamps)
    steps = speed / rate * np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    velocity = np.stack([np.full(len(stamps), speed), np.zeros(len(stamps))], axis=1)
    return stamps, np.cumsum(steps, axis=0), Motion(yaw, velocity)


def without(drive, first, last, shift=(0.0, 0.0)):
    """Lose the messages of some seconds, and let the places after them lie elsewhere."""
    stamps, xy, motion = drive
    xy = xy + (stamps > first)[:, np.newaxis] * np.array(shift)
    kept = (stamps < first) | (stamps > last)
    return stamps[kept], xy[kept], motion.at(kept)


def test_a_hole_that_speeds_lead_across_is_filled_in_and_said():
    found = whole_drive(*_arguments(without(straight(), 8.0, 9.7)))
    assert any('0.7' in doubt and 'is filled in, as speeds and headings' in doubt
               for doubt in found.doubts)


@pytest.mark.parametrize(('last', 'shift'), [
    (11.0, (0.0, 0.0)), (9.7, (0.0, 0.3)), (9.7, (-0.25, 0.0)), (9.7, (0.25, 0.0))], ids=str)
def test_one_that_is_long_or_leads_elsewhere_breaks_the_drive(last, shift):
    with pytest.raises(ImplausibleDriveError):
        whole_drive(*_arguments(without(straight(), 8.0, last, shift)))


@pytest.mark.parametrize('blind', ['speeds', 'all'])
def test_without_speeds_nobody_knows_the_way(blind):
    stamps, xy, motion = without(straight(), 8.0, 9.7)
    motion = Motion(motion.yaw if blind == 'speeds' else 0.0 * motion.yaw)
    with pytest.raises(ImplausibleDriveError, match='no pose has come between'):
        whole_drive(stamps, xy, LIMITS, motion)


def test_a_heading_that_leaps_while_the_way_goes_on_is_a_doubt():
    stamps, xy, motion = straight(rate=30.0)
    turned = motion.yaw + 2.5 * np.clip((stamps - 10.0) / 0.2, 0.0, 1.0) ** 3
    velocity = motion.velocity * np.where(stamps > 10.1, np.cos(2.5), 1.0)[:, np.newaxis]
    found = whole_drive(stamps, xy, LIMITS, Motion(turned, velocity))
    assert len(found.kept) == len(stamps)


def _arguments(drive):
    stamps, xy, motion = drive
    return stamps, xy, LIMITS, motion
