"""What is missing is said now and then, and that it is back as often as it was missed."""

from msgs_bridge.node.throttled_log import Complaints, KINDS, PERIOD


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


def refuses(*said):
    """Refuse (time, text, source) one after the other; return what was said."""
    log = Log()
    complaints = Complaints(log, lambda: log.now)
    for now, text, source in said:
        log.now = now
        complaints.refused(ValueError(text), source)
    return log.lines


def test_a_kind_of_refusal_is_said_once_a_period_whatever_its_numbers():
    kind = ("x is -1.5e+10, frame is 'a'", "x is 7, frame is 'b 2'", "x is nan, frame is ''")
    assert refuses(*((0.5 * PERIOD * k, kind[k % 3], None) for k in range(5))) == [
        f'refused: {kind[k % 3]}' for k in (0, 2, 4)]


def test_one_kind_of_refusal_does_not_hide_another():
    assert refuses((0.0, 'scan: range is nan', None), (0.1, 'orientation is no rotation', None),
                   (0.2, 'scan: range is -1', None)) == [
        'refused: scan: range is nan', 'refused: orientation is no rotation']


def test_who_sends_ever_new_kinds_is_not_heard_without_end_and_hides_no_other_source():
    flood = [(1e-3 * k, 'x' * k, 'experience') for k in range(1, 100)]
    assert len(refuses(*flood)) == KINDS + 1
    assert refuses(*flood, (1.0, 'name is missing', 'trial'))[-1] == 'refused: name is missing'
    assert len(refuses(*flood, *((PERIOD + t, *rest) for t, *rest in flood))) == 2 * (KINDS + 1)
