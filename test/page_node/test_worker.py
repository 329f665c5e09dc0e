"""The process that does what takes long: it answers, refuses, dies and comes back."""

import asyncio
import os
from pathlib import Path
import signal
import threading
import time

import pytest

from page_node.memory.worker import Worker
from page_node.refusal import RefusedError

PATIENT = 60.0


@pytest.fixture
def worker():
    made = Worker(most_waiting=4)
    yield made
    made.close()


def result(worker, function, *arguments, patience=PATIENT):
    return worker.submit(patience, function, *arguments).result(PATIENT)


def is_alive(pid):
    try:
        return 'State:\tZ' not in Path(f'/proc/{pid}/status').read_text()
    except FileNotFoundError:
        return False


def until(holds):
    deadline = time.monotonic() + PATIENT
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_function_is_called_in_a_process_of_its_own(worker):
    assert worker.pid is None
    pid = result(worker, os.getpid)
    assert pid == worker.pid != os.getpid()
    assert result(worker, os.getpid) == pid
    assert result(worker, os.nice, 0) >= 10


def test_it_is_asked_from_a_loop_and_others_run_meanwhile(worker):
    async def ask():
        return await asyncio.gather(worker.ask(divmod, 7, 2), asyncio.sleep(0.0, 'others'))

    assert asyncio.run(ask()) == [(3, 1), 'others']


def test_a_refusal_comes_back_and_a_mistake_is_one(worker, capfd):
    with pytest.raises(RefusedError) as refused:
        result(worker, int, 'no number')
    assert (refused.value.code, refused.value.status) == ('mistake', 500)
    assert 'invalid literal' in str(refused.value)
    until(lambda: 'ValueError' in capfd.readouterr().err)
    # What cannot be copied back is a mistake, too, and the process goes on.
    with pytest.raises(RefusedError, match='cannot pickle'):
        result(worker, threading.Lock)
    assert result(worker, abs, -1) == 1


def test_it_is_started_anew_when_it_died(worker):
    first = result(worker, os.getpid)
    with pytest.raises(RefusedError) as refused:
        result(worker, signal.raise_signal, signal.SIGKILL)
    assert refused.value.code == 'died'
    second = result(worker, os.getpid)
    os.kill(second, signal.SIGKILL)
    until(lambda: not is_alive(second))
    assert len({first, second, result(worker, os.getpid)}) == 3


def test_what_takes_too_long_is_ended(worker):
    pid = result(worker, os.getpid)
    with pytest.raises(RefusedError) as refused:
        result(worker, time.sleep, 600.0, patience=0.1)
    assert refused.value.code == 'too_long'
    assert not is_alive(pid)
    assert result(worker, abs, -1) == 1


def test_no_more_may_wait_than_is_said(worker):
    waiting = [worker.submit(PATIENT, time.sleep, 600.0) for _ in range(4)]
    with pytest.raises(RefusedError) as refused:
        worker.submit(PATIENT, abs, -1)
    assert (refused.value.code, refused.value.status) == ('busy', 503)
    until(waiting[0].running)
    assert waiting[3].cancel()
    worker.submit(PATIENT, abs, -1)


def test_it_ends_with_whoever_waits(worker):
    pid = result(worker, os.getpid)
    sleeping = worker.submit(PATIENT, time.sleep, 600.0)
    waiting = worker.submit(PATIENT, abs, -1)
    until(sleeping.running)
    worker.close()
    assert not is_alive(pid)
    assert waiting.cancelled()
    assert isinstance(sleeping.exception(), RefusedError)
    with pytest.raises(RefusedError):
        worker.submit(PATIENT, abs, -1)


def test_too_much_memory_is_refused(worker):
    with pytest.raises(RefusedError) as refused:
        result(worker, bytearray, 3 * 2**30)
    assert (refused.value.code, refused.value.status) == ('too_large', 413)
