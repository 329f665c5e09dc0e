"""Two senders on one topic: their stamps go back and forth, and nothing may fail for it."""

from control_field.robot.latency import LatencyMonitor


def test_stamps_of_two_senders_that_go_back_and_forth_lose_nothing():
    lateness = LatencyMonitor(0.3, 1.0)
    stamps = [0.0, 1.0, *(0.1 * k for k in range(2, 40)), 0.0]
    lateness._came.extend((100.0 + 0.02 * k, stamp, 0.0) for k, stamp in enumerate(stamps))
    assert lateness._share_lost() == 0.0
