"""Seeds in processes of their own, and what becomes of those whose process was killed."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from functools import partial
import multiprocessing
import os
import signal
import sys
import threading
import time
from typing import Any, Final, TypeAlias
import warnings

from experience_evaluation.experiment import Experiment, LearningCurve, run_seed
from experience_evaluation.progress import count_for, ProgressBar, Shares, tell_in
from msgs_bridge.node.environment import ENDING_SIGNALS

Task: TypeAlias = tuple[Any, ...]
#: How often a process looks whether its parent still lives, and that how far it is, [s].
_LOOK_EVERY: Final = 0.5
#: How often a task that may have killed its process gets another for itself alone.
_TRIES: Final = 2


class LostError(RuntimeError):
    """
    Some tasks kill whatever process they are given.

    Parameters
    ----------
    lost : sequence of int
        Which of the tasks.
    curves : sequence of LearningCurve
        What the others came to, in their order.

    """

    def __init__(self, lost: Sequence[int], curves: Sequence[Any]) -> None:
        super().__init__(f'{len(lost)} tasks were killed again and again, perhaps for want of '
                         f'memory')
        self.lost, self.curves = tuple(lost), list(curves)


def run_all(
    tasks: Sequence[tuple[Experiment, int]], n_jobs: int, title: str,
) -> list[LearningCurve]:
    """
    Run experiments with their seeds, with a progress bar where somebody looks.

    Parameters
    ----------
    tasks : sequence of (Experiment, int)
        Experiments, each with a seed.
    n_jobs : int
        Processes at once; what comes out does not depend on it, nor on processes that are killed.
    title : str
        Stands before the bar.

    Returns
    -------
    list of LearningCurve
        In the tasks' order.

    Raises
    ------
    NoWayError
        If a teacher finds no way.
    LostError
        If some were killed, whatever was done; it holds what is finished.

    """
    curves: dict[int, LearningCurve] = {}
    with ProgressBar(len(tasks), title, n_jobs > 1) as bar:
        numbered = [(run_seed, index, *task) for index, task in enumerate(tasks)]
        for index, curve in run(_numbered, numbered, n_jobs, partial(_say, title), bar):
            curves[index] = curve
            bar.end(index)
    finished = [curves[index] for index in sorted(curves)]
    if len(finished) < len(tasks):
        raise LostError([index for index in range(len(tasks)) if index not in curves], finished)
    return finished


def _numbered(work: Callable[..., Any], index: int, *task: Any) -> Any:
    """Do some work; what it tells of how far it is counts for a run."""
    count_for(index)
    return work(*task)


def _say(title: str, line: str) -> None:
    print(f'{title}: {line}', file=sys.stderr)


def run(
    work: Callable[..., Any], tasks: Sequence[Task], n_jobs: int, say: Callable[[str], None],
    bar: ProgressBar | None = None,
) -> Iterator[tuple[int, Any]]:
    """
    Do some work for each task, in processes of their own if there are several jobs.

    A pool loses all that is under way when one of its processes is killed. One of those tasks may
    have been the reason: each is done again alone, so that one that always dies takes no other
    with it. The others go on side by side.

    Yields
    ------
    index : int
        Of the task; that of a task whose processes are always killed does not come.
    result
        In whatever order they end.

    """
    if n_jobs <= 1 or len(tasks) <= 1:
        for index, task in enumerate(tasks):
            yield index, work(*task)
        return
    left = dict(enumerate(tasks))
    while left:
        for index, result in _side_by_side(work, dict(left), n_jobs, bar):
            del left[index]
            yield index, result
        # Tasks are begun in their order, and one more than there are processes is handed out.
        suspects = list(left)[:n_jobs + 1]
        if suspects:
            say(f'a working process was killed, perhaps for want of memory: the '
                f'{len(suspects)} runs under way are begun again, one by one')
        for index in suspects:
            yield from _alone(work, index, left.pop(index), bar)


def _alone(work: Callable[..., Any], index: int, task: Task, bar: ProgressBar | None,
           ) -> Iterator[tuple[int, Any]]:
    """Do the work for one task in a process of its own; nothing comes if that always dies."""
    for _ in range(_TRIES):
        done = list(_side_by_side(work, {index: task}, 1, bar))
        if done:
            yield from done
            return


def _side_by_side(
    work: Callable[..., Any], tasks: Mapping[int, Task], n_jobs: int, bar: ProgressBar | None,
) -> Iterator[tuple[int, Any]]:
    """Do the work with one pool; yield what is finished until the pool breaks."""
    with _quiet_tracker():
        # Fresh processes: a fork would take over whatever threads and locks this one has.
        pool = ProcessPoolExecutor(
            min(n_jobs, len(tasks)), multiprocessing.get_context('spawn'),
            initializer=_begin, initargs=(os.getpid(), None if bar is None else bar.shares))
    waiting = {}
    try:
        with _quiet_tracker(), _interrupted_later(), suppress(BrokenProcessPool):
            for index, task in tasks.items():
                waiting[pool.submit(work, *task)] = index
        for future in _as_completed(waiting, bar):
            with suppress(BrokenProcessPool):
                result = future.result()
                yield waiting[future], result
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()
        raise
    pool.shutdown()


def _as_completed(waiting: Iterable[Future[Any]], bar: ProgressBar | None,
                  ) -> Iterator[Future[Any]]:
    """Yield what is finished; meanwhile the bar goes on."""
    left = set(waiting)
    while left:
        done, left = wait(left, _LOOK_EVERY, FIRST_COMPLETED)
        if bar is not None:
            bar.look()
        yield from done


@contextmanager
def _quiet_tracker() -> Iterator[None]:
    """
    Keep multiprocessing's tracker of resources from complaining, if it starts meanwhile.

    It tidies up what a killed process leaves, and warns of each thing: nobody can do anything
    about that, and whoever pressed Ctrl-C reads it as a mistake.
    """
    before = list(sys.warnoptions)
    sys.warnoptions.append('ignore:resource_tracker:UserWarning')
    with warnings.catch_warnings():
        warnings.filterwarnings('ignore', 'resource_tracker')
        try:
            yield
        finally:
            sys.warnoptions[:] = before


@contextmanager
def _interrupted_later() -> Iterator[None]:
    """
    Keep Ctrl-C waiting while processes are started.

    One that is half started has not been told everything, or does not listen yet: it would die of
    it with a traceback. What is started meanwhile keeps it waiting until it is in `_begin`.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDING_SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING_SIGNALS)


def _begin(parent: int, shares: Shares | None) -> None:
    """Make a working process ready: it ends with its parent, and tells it how far it is."""
    tell_in(shares)
    _die_with(parent)


def _die_with(parent: int) -> None:
    """End at Ctrl-C without a word, for the parent says what is to be said; and end with it."""
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING_SIGNALS)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK_EVERY)
    os._exit(1)
