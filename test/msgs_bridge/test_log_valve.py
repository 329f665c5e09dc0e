"""What is said again and again is said now and then, with how often it was not."""

from rclpy.logging import get_logger

from msgs_bridge.node.log_valve import BURST, Valve
from msgs_bridge.node.safe_log import guard_logs


class Flood:
    """A valve with a clock; a line a millisecond."""

    def __init__(self):
        self.now = 0.0
        self.valve = Valve(lambda: self.now)

    def send(self, seconds, text, **options):
        said = []
        for k in range(round(1000 * seconds)):
            self.now += 0.001
            said.append(self.valve.let(text(k), **options))
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
        said.append(flood.valve.let('trial 3 starts'))
    assert said == ['trial 3 starts'] * 200


def test_ever_new_kinds_stay_below_two_thousand_characters_a_second():
    flood = Flood()
    flood.send(10.0, lambda k: f'{k:x} {chr(97 + k % 26) * (k % 700)} refused')
    said = flood.send(20.0, lambda k: f'{chr(97 + k % 26) * (k % 900)} refused')
    assert sum(map(len, said)) < 60_000
    assert flood.valve.let('the robot is stopped', is_grave=True)
    assert len(flood.valve._kinds) <= 256


def test_a_node_cannot_be_made_to_fill_its_log(capfd):
    guard_logs()
    logger = get_logger('valve_test')
    for k in range(3000):
        logger.warning(f'goal_pose: the control field leads to ({k}, {k + 1}) m only')
    text = capfd.readouterr().err
    assert BURST <= text.count('leads to') < BURST + 100
    assert len(text) < 20_000
