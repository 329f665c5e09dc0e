"""The profiles fit each other: whoever is meant to hear a topic does."""

import pytest
from rclpy.qos import qos_check_compatible, QoSCompatibility

from msgs_bridge import qos


@pytest.mark.parametrize(('publisher', 'reader'), [
    ('ODOMETRY_PUB', 'SENSOR'), ('SENSOR', 'SENSOR'), ('COMMAND', 'COMMAND'),
    ('LATCHED', 'LATCHED'), ('EXPERIENCE', 'EXPERIENCE'), ('POSE', 'POSE'),
])
def test_publishers_and_readers_fit(publisher, reader):
    fit, reason = qos_check_compatible(getattr(qos, publisher), getattr(qos, reader))
    # What is left to the system's default is a warning, never an obstacle.
    assert fit != QoSCompatibility.ERROR, reason
