"""A drive drawn in letters, for a terminal or a file of text."""

from typing import Final

import numpy as np
import numpy.typing as npt

#: Letters across and lines, at most; a letter is about twice as high as it is wide.
_COLUMNS, _LINES, _ASPECT = 72, 20, 2.0
#: No letter stands for less than so much, [m].
_FINEST: Final = 0.01


def drawing_lines(
    path: npt.NDArray[np.float64], cut: npt.NDArray[np.bool_] | None = None,
) -> list[str]:
    """
    Draw a way, x to the right and y up, and say what a letter stands for.

    Parameters
    ----------
    path : ndarray, shape (n, 2), [m]
        Finite.
    cut : ndarray of bool, shape (n,), optional
        Which of it are in loops that are not learnt.

    """
    if len(path) < 2:
        return []
    low, size = path.min(axis=0), np.ptp(path, axis=0)
    across = max(size[0] / (_COLUMNS - 1), size[1] / _ASPECT / (_LINES - 1), _FINEST)
    letters = np.full((int(size[1] / across / _ASPECT) + 1, int(size[0] / across) + 1), ' ')
    cut = np.zeros(len(path), dtype=np.bool_) if cut is None else cut
    for which, letter in ((cut, ':'), (~cut, '*')):
        points = _filled(path, which, across)
        letters[_places(points, low, across)] = letter
    for end, letter in ((0, 'S'), (-1, 'G')):
        letters[_places(path[[end]], low, across)] = letter
    loops = ', : a loop that is not learnt' if cut.any() else ''
    size_text = f'a letter is {across:.2g} m wide and {_ASPECT * across:.2g} m high'
    return [*(''.join(line).rstrip() for line in letters[::-1]),
            f'(S start, G end{loops}; {size_text})']


def _filled(
    path: npt.NDArray[np.float64], which: npt.NDArray[np.bool_], step: float,
) -> npt.NDArray[np.float64]:
    """Return the points of some of a way, so close that no letter is left out between them."""
    first = np.flatnonzero(which[:-1] & which[1:])
    n = np.ceil(np.abs(path[first + 1] - path[first]).max(axis=1, initial=0.0) / step).astype(int)
    n = np.clip(n, 1, _COLUMNS + _LINES)
    share = np.concatenate([np.arange(k) / k for k in n]) if len(n) else np.zeros(0)
    start = np.repeat(first, n)
    between = path[start] + share[:, np.newaxis] * (path[start + 1] - path[start])
    return np.concatenate([path[which], between])


def _places(
    points: npt.NDArray[np.float64], low: npt.NDArray[np.float64], across: float,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    places = ((points - low) / [across, _ASPECT * across] + 1e-9).astype(np.int64)
    return places[:, 1], places[:, 0]
