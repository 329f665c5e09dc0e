"""What a file of a map holds."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class MapFile:
    """
    A map that was read.

    Parameters
    ----------
    occupancy : ndarray of int8, shape (n_rows, n_cols)
        0 free, 100 blocked; row 0 at the lowest y. Pixels whose state is unknown are blocked: in
        a true world there is no third kind.
    resolution : float, [m]
        Side of a pixel.
    corner : tuple of float
        (x, y) of the lower left corner of pixel (0, 0) [m].
    notes : tuple of str
        What a user should know: each one sentence that names the file.

    """

    occupancy: npt.NDArray[np.int8]
    resolution: float
    corner: tuple[float, float] = (0.0, 0.0)
    notes: tuple[str, ...] = ()
