"""Arrays of one window of a lattice, as another window has them."""

from typing import Any

import numpy as np
import numpy.typing as npt

from control_field.grid import Grid


def moved(
    values: npt.NDArray[Any], old: Grid, new: Grid, fill: float,
) -> npt.NDArray[Any]:
    """
    Return what an array says of each cell, as a workspace of the same lattice has it.

    Parameters
    ----------
    values : ndarray, shape (old.n_rows, old.n_cols, ...)
    old, new : Grid
    fill : float
        Of the cells that the old workspace does not have.

    Returns
    -------
    ndarray, shape (new.n_rows, new.n_cols, ...)
        A copy; what lies outside the new workspace is left out.

    Raises
    ------
    ValueError
        If the two are not of one lattice.

    """
    offset = old.offset_to(new)
    if offset is None:
        raise ValueError(f'{old} and {new} do not share their cells')
    shape = (*new.shape, *values.shape[2:])
    # Zeros that nobody reads cost nothing.
    there = np.full(shape, fill, dtype=values.dtype) if fill else np.zeros(shape, values.dtype)
    here, to = [], []
    for n_old, n_new, shift in zip(old.shape, new.shape, offset, strict=True):
        low, high = max(shift, 0), min(n_old + shift, n_new)
        to.append(slice(low, max(high, low)))
        here.append(slice(low - shift, max(high, low) - shift))
    there[tuple(to)] = values[tuple(here)]
    return there
