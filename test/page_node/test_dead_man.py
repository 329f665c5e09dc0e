"""Who drives, and for how long: times are made up, and exact."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from page_node.driving.dead_man import (
    DeadMan, HOLD_TIME, LINGER, MOST_AGE, RESERVED, STANDING, Verdict)

AHEAD = (1.0, 0.0)
LEFT = (0.0, 0.5)
#: How often a page repeats what is held, [s].
PERIOD = 0.05


class Bench:
    """A dead-man, a clock, and people with clocks of their own."""

    def __init__(self):
        self.man, self.now = DeadMan(), 100.0

    def join(self):
        return self.man.join()

    def wait(self, seconds):
        self.now += seconds

    def tell(self, link, share, age=0.0, clock=-37.0):
        return self.man.command(link, self.now + clock - age, share, self.now)

    def hold(self, link, share, seconds):
        """Repeat a command as a page does; return the verdicts."""
        verdicts = []
        end = self.now + seconds
        while self.now < end - 1e-9:
            verdicts.append(self.tell(link, share))
            self.wait(PERIOD)
        return verdicts

    @property
    def share(self):
        return self.man.share(self.now)

    @property
    def stands(self):
        return self.share in (None, STANDING)

    @property
    def driver(self):
        return self.man.driver(self.now)


@pytest.fixture
def bench():
    return Bench()


class TestHolding:
    def test_nothing_is_said_before_somebody_drives(self, bench):
        bench.join()
        assert bench.share is None
        assert bench.driver is None

    def test_what_is_held_is_driven(self, bench):
        one = bench.join()
        assert set(bench.hold(one, AHEAD, 1.0)) == {Verdict.OBEYED}
        assert bench.share == AHEAD

    def test_silence_is_standstill_in_time(self, bench):
        one = bench.join()
        bench.tell(one, AHEAD)
        bench.wait(HOLD_TIME - 0.001)
        assert bench.share == AHEAD
        bench.wait(0.001)
        assert bench.share == STANDING

    def test_the_end_is_told_however_late_it_is_noticed(self, bench):
        one = bench.join()
        bench.tell(one, AHEAD)
        bench.wait(60.0)
        assert bench.share == STANDING

    def test_silence_ends_early_enough_for_the_robot_to_stop(self):
        assert HOLD_TIME <= 0.2

    def test_letting_go_is_standstill_at_once_and_then_nothing_is_said(self, bench):
        one = bench.join()
        bench.tell(one, AHEAD)
        bench.tell(one, STANDING)
        assert bench.share == STANDING
        bench.wait(LINGER + 0.001)
        assert bench.share is None

    def test_who_leaves_leaves_the_robot_standing(self, bench):
        one = bench.join()
        bench.tell(one, AHEAD)
        bench.man.leave(one, bench.now)
        assert bench.share == STANDING

    def test_who_leaves_without_driving_does_not_stop_who_drives(self, bench):
        one, other = bench.join(), bench.join()
        bench.tell(one, AHEAD)
        bench.man.leave(other, bench.now)
        assert bench.share == AHEAD


class TestAge:
    def test_old_commands_are_dropped(self, bench):
        one = bench.join()
        bench.tell(one, STANDING)
        assert bench.tell(one, AHEAD, age=MOST_AGE + 0.01) is Verdict.STALE
        assert bench.share is None
        assert bench.tell(one, AHEAD, age=MOST_AGE - 0.01) is Verdict.OBEYED

    def test_what_was_sent_during_a_stall_is_not_replayed_after_it(self, bench):
        one = bench.join()
        bench.hold(one, AHEAD, 0.5)
        bench.wait(2.0)
        late = [bench.tell(one, AHEAD, age=age) for age in (2.0, 1.5, 1.0, 0.5, 0.3)]
        assert set(late) == {Verdict.STALE}
        assert bench.stands

    def test_letting_go_is_obeyed_at_any_age(self, bench):
        one = bench.join()
        bench.tell(one, AHEAD)
        bench.wait(0.1)
        bench.tell(one, STANDING, age=5.0)
        assert bench.share == STANDING

    @pytest.mark.parametrize('drift', [-200e-6, 200e-6])
    def test_clocks_that_drift_do_not_make_fresh_commands_old(self, bench, drift):
        one = bench.join()
        start = bench.now
        for _ in range(3600):  # an hour
            bench.wait(1.0)
            age = drift * (bench.now - start)
            assert bench.tell(one, AHEAD, age=age) is not Verdict.STALE

    @pytest.mark.parametrize('sent', [0.0, -1e9, 1e12])
    def test_any_clock_will_do(self, bench, sent):
        one = bench.join()
        assert bench.man.command(one, sent, AHEAD, bench.now) is Verdict.OBEYED


class TestOneDriver:
    def test_others_wait_until_the_driver_has_let_go_for_a_while(self, bench):
        one, other = bench.join(), bench.join()
        bench.tell(one, AHEAD)
        assert bench.tell(other, LEFT) is Verdict.OTHER
        assert bench.share == AHEAD
        bench.tell(one, STANDING)
        bench.wait(RESERVED - 0.001)
        assert bench.tell(other, LEFT) is Verdict.OTHER
        assert bench.driver == one
        bench.wait(0.001)
        assert bench.driver is None
        assert bench.tell(other, LEFT) is Verdict.OBEYED
        assert bench.driver == other

    def test_who_does_not_drive_stops_nobody_by_letting_go(self, bench):
        one, other = bench.join(), bench.join()
        bench.tell(one, AHEAD)
        bench.tell(other, STANDING)
        assert bench.share == AHEAD

    def test_the_driver_may_go_on_before_others(self, bench):
        one = bench.join()
        bench.tell(one, AHEAD)
        bench.tell(one, STANDING)
        bench.wait(0.3)
        assert bench.tell(one, LEFT) is Verdict.OBEYED

    def test_others_may_drive_once_the_driver_is_gone(self, bench):
        one, other = bench.join(), bench.join()
        bench.tell(one, AHEAD)
        bench.man.leave(one, bench.now)
        bench.wait(RESERVED)
        assert bench.tell(other, LEFT) is Verdict.OBEYED


class TestStop:
    def test_it_is_standstill_and_what_is_held_has_to_be_let_go_of(self, bench):
        one = bench.join()
        bench.hold(one, AHEAD, 0.5)
        bench.man.stop(bench.now)
        assert bench.share == STANDING
        assert set(bench.hold(one, AHEAD, 5.0)) == {Verdict.HELD_BACK}
        assert bench.share is None
        bench.tell(one, STANDING)
        assert bench.tell(one, AHEAD) is Verdict.OBEYED

    def test_who_holds_something_in_vain_has_to_let_go_too(self, bench):
        one, other = bench.join(), bench.join()
        bench.tell(one, AHEAD)
        bench.tell(other, LEFT)
        bench.man.stop(bench.now)
        bench.wait(PERIOD)
        assert bench.tell(other, LEFT) is Verdict.HELD_BACK
        assert bench.man.share(bench.now) == STANDING

    def test_the_robot_is_told_though_nobody_drove(self, bench):
        bench.man.stop(bench.now)
        assert bench.share == STANDING

    def test_who_comes_later_may_drive(self, bench):
        bench.man.stop(bench.now)
        assert bench.tell(bench.join(), AHEAD) is Verdict.OBEYED


class TestAfterSilence:
    def test_a_page_in_the_background_that_comes_once_a_second_does_not_drive(self, bench):
        one = bench.join()
        bench.hold(one, AHEAD, 0.5)
        for _ in range(10):
            bench.wait(1.0)
            assert bench.tell(one, AHEAD) is Verdict.HELD_BACK
            assert bench.stands

    def test_who_is_back_in_rhythm_goes_on(self, bench):
        one = bench.join()
        bench.hold(one, AHEAD, 0.5)
        bench.wait(1.0)
        assert bench.hold(one, AHEAD, 0.2) == [Verdict.HELD_BACK, *[Verdict.OBEYED] * 3]

    def test_a_new_press_counts_at_once(self, bench):
        one = bench.join()
        bench.hold(one, AHEAD, 0.5)
        bench.wait(1.0)
        bench.tell(one, STANDING)
        assert bench.tell(one, AHEAD) is Verdict.OBEYED


COMMANDS = st.tuples(st.floats(0.0, 0.4), st.integers(0, 2),
                     st.sampled_from([AHEAD, LEFT, STANDING, 'stop', 'leave']),
                     st.floats(0.0, 0.5))


@given(st.lists(COMMANDS, max_size=40))
def test_whatever_comes_the_robot_moves_by_a_fresh_command_of_one_driver_only(commands):
    bench = Bench()
    links = [bench.join() for _ in range(3)]
    obeyed = None
    for pause, who, what, age in commands:
        bench.wait(pause)
        if what == 'stop':
            bench.man.stop(bench.now)
            obeyed = None
        elif what == 'leave':
            bench.man.leave(links[who], bench.now)
            obeyed = None if obeyed and obeyed[1] == links[who] else obeyed
            links[who] = bench.join()
        elif bench.tell(links[who], what, age) is Verdict.OBEYED:
            if what != STANDING:
                assert obeyed is None or obeyed[1] == links[who] or (
                    bench.now - obeyed[0] >= HOLD_TIME)
                obeyed = bench.now, links[who], what
            elif obeyed and obeyed[1] == links[who]:
                obeyed = None
        share = bench.share
        if share not in (None, STANDING):
            assert obeyed is not None
            assert bench.now - obeyed[0] < HOLD_TIME
            assert obeyed[2] == share
