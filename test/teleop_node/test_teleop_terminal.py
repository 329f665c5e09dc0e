"""A terminal hands over keys at once and is left as it was found, whatever happens."""

from contextlib import contextmanager, suppress
import os
import pty
import signal
import termios

import pytest

from teleop_node.lifecycle import Signals
from teleop_node.terminal import Terminal


@contextmanager
def pair():
    master, slave = pty.openpty()
    try:
        yield master, slave
    finally:
        for descriptor in (master, slave):
            with suppress(OSError):  # the test has closed it
                os.close(descriptor)


def test_every_key_at_once_and_no_echo():
    with pair() as (master, slave), Terminal(slave, slave) as terminal:
        assert os.read(master, 100) == b'\x1b[?2004h'
        assert terminal.read() == b''
        os.write(master, b'i')
        assert terminal.read() == b'i'
        terminal.write('hello')
        assert os.read(master, 100) == b'hello'


def test_ctrl_s_stops_no_output():
    with pair() as (master, slave), Terminal(slave, slave) as terminal:
        os.write(master, b'\x13')
        assert terminal.read() == b'\x13'


@pytest.mark.parametrize('error', [ValueError, KeyboardInterrupt, SystemExit])
def test_it_is_restored_after_any_error(error):
    with pair() as (_, slave):
        before = termios.tcgetattr(slave)
        terminal = Terminal(slave, slave)
        with pytest.raises(error), terminal:
            raise error
        assert termios.tcgetattr(slave) == before


def test_leaving_twice_and_entering_again():
    with pair() as (_, slave):
        before = termios.tcgetattr(slave)
        terminal = Terminal(slave, slave)
        for _ in range(2):
            assert terminal.enter()
            assert terminal.enter()
            terminal.leave()
            terminal.leave()
            assert termios.tcgetattr(slave) == before


def test_a_terminal_that_went_away():
    with pair() as (master, slave):
        terminal = Terminal(slave, slave)
        terminal.enter()
        os.close(master)
        assert terminal.read() is None
        terminal.write('nobody reads this')
        terminal.leave()


def test_output_that_nobody_takes_is_not_waited_for():
    with pair() as (_, slave), Terminal(slave, slave) as terminal:
        for _ in range(2000):
            terminal.write('x' * 100)


class Log(list):
    def pause(self):
        self.append('pause')

    def go_on(self):
        self.append('go on')


class TestSignals:
    @pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP,
                                        signal.SIGQUIT])
    def test_an_end(self, number):
        before, log = signal.getsignal(number), Log()
        with Signals() as signals:
            assert not signals.is_ended
            os.kill(os.getpid(), number)
            assert signals.is_ended
            signals.look(log, lambda: log.append('stopped'))
        assert signal.getsignal(number) == before
        assert log == []

    def test_a_pause(self):
        log = Log()
        with Signals() as signals:
            signals.look(log, lambda: log.append('stopped'))
            os.kill(os.getpid(), signal.SIGTSTP)
            assert not signals.is_ended
            for _ in range(2):
                signals.look(log, lambda: log.append('stopped'))
        assert log == ['pause', 'stopped', 'go on']
