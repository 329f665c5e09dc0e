"""What nodes log holds no code that a terminal obeys."""

from rclpy.logging import get_logger

from msgs_bridge.node.safe_log import guard_logs


def lines(capfd):
    return [line for line in capfd.readouterr().err.splitlines() if 'safe_log_test' in line]


def test_codes_in_a_log_are_shown(capfd):
    guard_logs()
    guard_logs()
    get_logger('safe_log_test').warning('refused: /odom\x1b]0;x\x07: frame \u202e\nis [ERROR] bad')
    assert [line.partition(': ')[2] for line in lines(capfd)] == [
        r'refused: /odom\x1b]0;x\x07: frame \u202e\nis [ERROR] bad']


def test_who_logs_is_still_told_apart(capfd):
    guard_logs()
    logger = get_logger('safe_log_test')
    for _ in range(3):
        logger.warning('the one', once=True)
        logger.warning('the other', once=True)
    assert [line.partition(': ')[2] for line in lines(capfd)] == ['the one', 'the other']
