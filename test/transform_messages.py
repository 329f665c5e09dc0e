"""Messages of `/tf`, serialised: what goes over the wire, whether tf2_msgs is installed or not."""

import math
import struct
import sys
from types import ModuleType

from visualization_msgs.msg import MarkerArray

from borrowed_type import borrowed_type
from msgs_bridge.node.tf_type import transforms_type


def transforms_message(*edges, stamp=1.0):
    """Return the bytes of a TFMessage of level edges: parent, child, x, y, yaw."""
    data = bytearray(struct.pack('<I', len(edges)))

    def pad(n):
        data.extend(bytes(-len(data) % n))

    for parent, child, x, y, yaw in edges:
        pad(4)
        data.extend(struct.pack('<iI', int(stamp), round(stamp % 1.0 * 1e9)))
        for name in (parent, child):
            pad(4)
            data.extend(struct.pack('<I', len(name) + 1) + name.encode() + b'\0')
        pad(8)
        data.extend(struct.pack(
            '<7d', x, y, 0.0, 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)))
    return b'\0\1\0\0' + bytes(data)


def type_of_transforms(monkeypatch):
    """Return tf2_msgs' type; where it is not installed, one of that name which packs nothing."""
    if transforms_type() is None:
        package, messages = ModuleType('tf2_msgs'), ModuleType('tf2_msgs.msg')
        messages.TFMessage = borrowed_type('tf2_msgs', 'TFMessage', MarkerArray)
        monkeypatch.setitem(sys.modules, 'tf2_msgs', package)
        monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', messages)
    return transforms_type()
