"""What the field asked for is told where the collision monitor let something else through."""

from controller_bench import Bench


def test_a_start_is_ramped_and_what_was_asked_for_is_told():
    bench = Bench().start()
    bench.tick()
    first = next(answer for answer in bench.sent if answer.velocity not in (None, (0.0, 0.0)))
    assert first.requested is not None
    assert first.requested[0] > first.velocity[0] > 0.0


def test_what_passes_the_gate_as_it_is_is_not_told_twice():
    bench = Bench().start()
    bench.run()
    passed = [answer for answer in bench.sent if answer.velocity and answer.requested is None]
    clipped = [answer for answer in bench.sent if answer.requested is not None]
    assert len(passed) > len(clipped) > 0
    assert all(answer.requested != answer.velocity for answer in clipped)
