"""Big frames of the page, read as its own reader in JavaScript does."""

import json

import numpy as np

from page_node.big_frames import TYPES


def frame_from_bytes(data):
    """Return header and arrays of a big frame; nothing may be left over."""
    length = int.from_bytes(data[:4], 'little')
    header, offset, arrays = json.loads(data[4:4 + length]), 4 + length, {}
    for column in header.pop('arrays'):
        kind, n = np.dtype(TYPES[column['dtype']]), int(np.prod(column['shape']))
        arrays[column['name']] = np.frombuffer(data, kind, n, offset).reshape(column['shape'])
        offset += n * kind.itemsize
    assert offset == len(data)
    return header, arrays
