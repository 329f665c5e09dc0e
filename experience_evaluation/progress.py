"""How far an evaluation is, in this process and in those that work for it: one line."""

import ctypes
from multiprocessing import get_context
import sys
from types import TracebackType
from typing import Any, Final, TypeAlias

from tqdm import tqdm  # type: ignore[import-untyped, unused-ignore]

from msgs_bridge.untrusted.text import own_stream, printable

#: Of each run, how much of it is done, 0 to 1; shared by processes.
Shares: TypeAlias = ctypes.Array[ctypes.c_double]
_FORMAT: Final = '{desc}: {percentage:3.0f}%|{bar:20}| {elapsed}, {remaining} to go{postfix}'
#: Where `tell` writes to in this process.
_told: dict[str, Any] = {'shares': None, 'bar': None, 'index': 0}


class ProgressBar:
    """
    Shows how much of some runs is done, how long it takes yet, and what is under way.

    Parameters
    ----------
    n_runs : int
    title : str
        Stands before the bar.
    is_shared : bool
        Whether runs are made in other processes: then what is under way is not told.

    Attributes
    ----------
    shares : array of float
        How much of each run is done, 0 to 1.

    """

    def __init__(self, n_runs: int, title: str, is_shared: bool) -> None:
        self.shares: Shares = get_context('spawn').RawArray(ctypes.c_double, n_runs)
        self._is_shared, self._n_ended = is_shared, 0
        # disable=None: no bar where standard error is no terminal.
        self._bar = tqdm(total=n_runs, desc=printable(title), file=own_stream(sys.stderr),
                         disable=None, bar_format=_FORMAT, dynamic_ncols=True)

    def __enter__(self) -> 'ProgressBar':
        """Let `tell` of this process tell this bar."""
        _told.update(shares=self.shares, bar=self)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Leave the line as it is."""
        _told.update(shares=None, bar=None)
        self._bar.close()

    def look(self, what: str = '') -> None:
        """Show how much is done now."""
        if self._is_shared:
            what = f'{self._n_ended} of {len(self.shares)} runs are over'
        self._bar.set_postfix_str(printable(what), refresh=False)
        self._bar.update(sum(self.shares) - self._bar.n)

    def end(self, index: int) -> None:
        """Count a run as done."""
        self._n_ended += 1
        self.shares[index] = 1.0
        self.look()


def tell_in(shares: Shares | None) -> None:
    """Let `tell` of this process write into an array of another one."""
    _told['shares'] = shares


def count_for(index: int) -> None:
    """Let what is told from now on count for a run."""
    _told['index'] = index


def tell(what: str, share: float) -> None:
    """
    Tell whoever looks how far the present run is.

    Parameters
    ----------
    what : str
        What is under way.
    share : float
        Of the run that is done, 0 to 1.

    """
    if _told['shares'] is not None:
        _told['shares'][_told['index']] = share
    if _told['bar'] is not None:
        _told['bar'].look(what)
