"""The background worker: jobs, their results and their mistakes."""

import threading

import pytest

from episode_store.rosbag2.errors import BagError
from learner_node.learning.background_worker import BackgroundWorker, result_of


def test_hands_results_to_whom_collects_them():
    worker, woken, got = BackgroundWorker(), threading.Event(), []
    worker.wake = woken.set
    worker.do(threading.get_ident, got.append)
    assert woken.wait(5.0)
    assert got == []
    worker.collect()
    assert got[0].result() != threading.get_ident()
    assert worker.close(5.0)


def test_hands_over_errors_and_goes_on():
    worker, got = BackgroundWorker(), []
    worker.do(lambda: 1 / 0, got.append)
    worker.do(lambda: 2, got.append)
    assert worker.close(5.0)
    worker.collect()
    assert isinstance(got[0].exception(), ZeroDivisionError)
    assert got[1].result() == 2


def test_a_mistake_of_ours_is_one_line_and_logged_with_its_place():
    worker, got, logged = BackgroundWorker(), [], []
    worker.do(lambda: 1 / 0, got.append)
    assert worker.close(5.0)
    worker.collect()
    with pytest.raises(BagError, match=r'^a mistake .*ZeroDivisionError: division by zero$'):
        result_of(got[0], logged.append)
    assert 'test_background_worker.py' in logged[0]


def test_does_not_wait_for_ever():
    worker, release = BackgroundWorker(), threading.Event()
    worker.do(release.wait, lambda future: None)
    assert not worker.close(0.01)
    release.set()
