"""What is missing is said now and then, and that it is back as often as it was missed."""

from msgs_bridge.complaints import Complaints, PERIOD


class Log:
    """A node and its logger in one, with a clock that is set."""

    def __init__(self):
        self.lines, self.now = [], 0.0

    def get_logger(self):
        return self

    def warning(self, text, **_):
        self.lines.append(text)

    info = warning


def looks(*said):
    """Look at (time, problem, kind) one after the other; return what was said."""
    log = Log()
    complaints = Complaints(log, lambda: log.now)
    for now, problem, kind in said:
        log.now = now
        complaints.look(problem, 'back', kind)
    return log.lines


def test_the_same_is_said_once_a_period():
    assert looks(*((0.5 * PERIOD * k, 'no tea', None) for k in range(5))) == ['no tea'] * 3


def test_that_it_is_back_is_said_once_and_only_after_it_was_missed():
    assert looks((0.0, '', None), (1.0, 'no tea', None), (2.0, '', None), (3.0, '', None)) == [
        'no tea', 'back']
    assert looks((0.0, 'no tea', None), (1.0, '', None), (2.0, 'no tea', None), (3.0, '', None)
                 ) == ['no tea', 'back']


def test_one_problem_does_not_hide_another():
    assert looks((0.0, 'no tea', 1), (1.0, 'cold tea', 2), (2.0, 'no tea', 1)) == [
        'no tea', 'cold tea']


def test_a_clock_that_begins_anywhere():
    assert looks((-5.0, 'no tea', None)) == ['no tea']
