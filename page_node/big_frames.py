"""
Big frames on the wire: a JSON header, then the arrays that it names, back to back.

First comes the length of the header as four bytes, the lowest first; blanks at its end let the
arrays begin at a multiple of four.
"""

from collections.abc import Mapping
import json
from typing import Any, Final

import numpy as np
import numpy.typing as npt

#: Types of numbers by what the page calls them.
TYPES: Final[Mapping[str, str]] = {'u1': 'u1', 'i1': 'i1', 'u2': '<u2', 'i4': '<i4', 'f4': '<f4'}


def bytes_from_frame(
    header: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]],
) -> bytes:
    """
    Put a frame together.

    Parameters
    ----------
    header : mapping
        Its `type`, and what else can be JSON.
    arrays : mapping of str to ndarray
        Of the types in `TYPES`, by name.

    Raises
    ------
    ValueError
        If an array is of another type, or a number in the header is none.

    """
    types = {name: _type_of(name, array) for name, array in arrays.items()}
    columns = [{'name': name, 'dtype': types[name], 'shape': list(array.shape)}
               for name, array in arrays.items()]
    text = json.dumps({**header, 'arrays': columns}, allow_nan=False).encode()
    text += b' ' * (-len(text) % 4)
    parts = [np.ascontiguousarray(array, TYPES[types[name]]).tobytes()
             for name, array in arrays.items()]
    return b''.join([len(text).to_bytes(4, 'little'), text, *parts])


def _type_of(name: str, array: npt.NDArray[Any]) -> str:
    found = f'{array.dtype.kind}{array.dtype.itemsize}'
    if found not in TYPES:
        raise ValueError(f'{name} is of type {array.dtype}, must be one of {", ".join(TYPES)}')
    return found
