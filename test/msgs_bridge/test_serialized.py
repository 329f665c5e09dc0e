from array import array

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField

from msgs_bridge.messages.serialized import cdr_from_cloud


@pytest.mark.parametrize('n', [0, 1, 5, 96_000])
@pytest.mark.parametrize('frame', ['odom', 'm', ''])
@pytest.mark.parametrize('dense', [True, False])
def test_of_its_bytes_ros_makes_the_cloud(n, frame, dense):
    cloud = PointCloud2(width=n, height=1, point_step=1, row_step=n, is_dense=dense,
                        data=array('B', bytes(i % 251 for i in range(n))),
                        fields=[PointField(name='x', count=1, datatype=2)])
    cloud.header.frame_id = frame
    cdr = cdr_from_cloud(cloud)
    # What stands between a text and the number after it is left open by ROS.
    assert len(cdr) == len(bytes(serialize_message(cloud)))
    assert deserialize_message(cdr, PointCloud2) == cloud
    assert len(cloud.data) == n
