"""Equations 2, 3 and 7: inverse-distance interpolation of prototypes, weighted by Q-values."""

import numpy as np
import numpy.typing as npt


def weight_from_q(q: npt.NDArray[np.float64], floor: float) -> npt.NDArray[np.float64]:
    """
    Map Q-values to the weights of eq. 7: positive, monotone, and blind to the scale of Q.

    A signed Q puts zeros into eq. 7's denominator, so the values are mapped linearly onto
    [floor, 1], zero Q (or the least one, if negative) to ``floor`` and the greatest to 1.

    Parameters
    ----------
    q : ndarray, shape (n,)
        Q-values, finite.
    floor : float
        Weight of the least value, above 0, at most 1.

    Returns
    -------
    ndarray, shape (n,)
        Weights; all 1 where the values do not differ.

    """
    if len(q) == 0:
        return np.ones(0)
    least, greatest = min(float(q.min()), 0.0), float(q.max())
    if greatest <= least:
        return np.ones(len(q))
    return floor + (1.0 - floor) * (q - least) / (greatest - least)


def interpolate(
    points: npt.NDArray[np.float64], centres: npt.NDArray[np.float64],
    actions: npt.NDArray[np.float64], weights: npt.NDArray[np.float64], power: float,
    window: float = np.inf,
) -> npt.NDArray[np.float64]:
    """
    Evaluate eq. 7 (eq. 3 where all weights are equal) at any points.

    `control_field.kernels.interpolation` sums the same up at the cells of a workspace, where
    windows are cut off by walls and prototypes are taken away again; here the window grows and
    distances are relative, which rounds differently: a field of profile paper is made with this.

    Parameters
    ----------
    points : ndarray, shape (m, 2)
        Where to evaluate.
    centres : ndarray, shape (n, 2)
        Of the prototypes, n >= 1; the unit of length is the caller's.
    actions : ndarray, shape (n, k)
        v_i of eq. 7.
    weights : ndarray, shape (n,)
        Positive; `weight_from_q`.
    power : float
        p of eq. 7.
    window : float
        Radius of the effective window. Where it holds no prototype it grows until it does.

    Returns
    -------
    ndarray, shape (m, k)
        A convex combination of the actions in the window; on a centre, exactly its action.

    Raises
    ------
    ValueError
        If there is no prototype.

    """
    if len(centres) == 0:
        raise ValueError('a control field needs at least one prototype')
    out = np.empty((len(points), actions.shape[1]))
    for i, point in enumerate(points):
        d = np.hypot(*(centres - point).T)
        nearest = float(d.min())
        if nearest == 0.0:
            out[i] = actions[int(d.argmin())]
            continue
        inside = d <= max(window, nearest)
        # Distances relative to the nearest one: the ratio of eq. 7 is the same, and neither a
        # tiny distance nor a large power can overflow.
        w = weights[inside] * (nearest / d[inside]) ** power
        out[i] = w @ actions[inside] / w.sum()
    return out
