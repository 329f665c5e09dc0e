"""Logs that say a thing once, once a period, or so many times a second."""

from rclpy.logging import get_logger

from msgs_bridge.node.safe_log import guard_logs
from msgs_bridge.node.throttled_log import (
    BURST, LogRateLimiter, MAX_TEMPLATES, OncePerTemplate, PERIOD, template_of, TEMPLATES,
    ThrottledLog)


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
    throttled = ThrottledLog(log, lambda: log.now)
    for now, problem, kind in said:
        log.now = now
        throttled.log_missing(problem, 'back', kind)
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
    throttled = ThrottledLog(log, lambda: log.now)
    for now, text, source in said:
        log.now = now
        throttled.log_refused(ValueError(text), source)
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
    assert len(refuses(*flood)) == TEMPLATES + 1
    assert refuses(*flood, (1.0, 'name is missing', 'trial'))[-1] == 'refused: name is missing'
    again = [(PERIOD + t, *rest) for t, *rest in flood]
    assert len(refuses(*flood, *again)) == 2 * (TEMPLATES + 1)


def test_numbers_and_quoted_text_make_no_other_template():
    assert template_of("odom: frame is 'a' at 1.5") == template_of("odom: frame is 'bc' at -3e9")
    assert template_of('odom: x is nan') != template_of('odom: y is nan')


def test_the_templates_told_apart_are_limited():
    logged = OncePerTemplate(limit=5)
    texts = [f'template {chr(97 + k)}' for k in range(20)]
    assert [logged.add(text) for text in texts] == [True] * 5 + [False] * 15
    assert not logged.add(texts[0])


class Flood:
    """A rate limiter with a clock; a line a millisecond."""

    def __init__(self):
        self.now = 0.0
        self.limiter = LogRateLimiter(lambda: self.now)

    def send(self, seconds, text, **options):
        said = []
        for k in range(round(1000 * seconds)):
            self.now += 0.001
            said.append(self.limiter.limit(text(k), **options))
        return [line for line in said if line]


def test_one_kind_a_thousand_times_a_second_is_said_once_a_second():
    said = Flood().send(100.0, lambda k: f"refused: odom: x is '{k}' at {k}")
    assert BURST <= len(said) <= BURST + 101
    assert said[-1].endswith('(999 more like it were not said)')


def test_what_comes_now_and_then_is_all_said_and_as_it_is():
    flood = Flood()
    said = []
    for _ in range(200):
        flood.now += 1.0
        said.append(flood.limiter.limit('trial 3 starts'))
    assert said == ['trial 3 starts'] * 200


def test_ever_new_kinds_stay_below_two_thousand_characters_a_second():
    flood = Flood()
    flood.send(10.0, lambda k: f'{k:x} {chr(97 + k % 26) * (k % 700)} refused')
    said = flood.send(20.0, lambda k: f'{chr(97 + k % 26) * (k % 900)} refused')
    assert sum(map(len, said)) < 60_000
    assert flood.limiter.limit('the robot is stopped', is_severe=True)
    assert len(flood.limiter._buckets) <= MAX_TEMPLATES


def test_a_node_cannot_be_made_to_fill_its_log(capfd):
    guard_logs()
    logger = get_logger('flood_test')
    for k in range(3000):
        logger.warning(f'goal_pose: the control field leads to ({k}, {k + 1}) m only')
    text = capfd.readouterr().err
    assert BURST <= text.count('leads to') < BURST + 100
    assert len(text) < 20_000
