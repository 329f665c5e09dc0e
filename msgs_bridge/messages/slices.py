"""
Large tables in slices: who works on one in a thread holds no other thread up.

Python's lock is given on between two calls of NumPy. One that goes over a million cells may keep
it for a tenth of a second; over a slice, for less than a millisecond.
"""

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from msgs_bridge.messages.clouds import first_bad, TableError

#: Cells of a slice.
_CELLS: Final = 2**13


def slices(shape: tuple[int, ...]) -> Iterator[slice]:
    """Return slices of the rows of a table, a few thousand cells each."""
    n = max(_CELLS // max(shape[1], 1), 1)
    for row in range(0, shape[0], n):
        yield slice(row, min(row + n, shape[0]))


def copied(column: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a copy in one piece and in this machine's byte order."""
    copy = np.empty(column.shape, column.dtype.newbyteorder('='))
    for rows in slices(column.shape):
        copy[rows] = column[rows]
    return copy


def check_slices(
    what: str, name: str, values: npt.NDArray[Any],
    is_good: Callable[[npt.NDArray[Any], slice], npt.NDArray[np.bool_]], must: str,
    error: type[TableError] = TableError,
) -> None:
    """
    Refuse a column if one of its values is not good; see `clouds.check_column`.

    Parameters
    ----------
    is_good : callable
        Gets the values of some rows, and which rows these are.

    Raises
    ------
    TableError
        Or ``error``, naming table, column, place and value, and what it must be.

    """
    for rows in slices(values.shape):
        if (place := first_bad(is_good(values[rows], rows))) is not None:
            there = (place[0] + rows.start, *place[1:])
            raise error(f'{what}: {name} is {values[there]} at {there}, must be {must}')
