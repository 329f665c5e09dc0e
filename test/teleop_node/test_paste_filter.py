"""What is pasted is no wish of anybody's: only what is typed counts."""

import random

from geometry_msgs.msg import Twist
from hypothesis import given
from hypothesis import strategies as st
import pytest
from std_srvs.srv import SetBool, Trigger

from msgs_bridge.messages.velocities import velocity_from_twist
import ros_helpers
from teleop_node.keys import ESCAPE, KeyParser, PASTE_BEGINS, PASTE_ENDS
from teleop_node.paste_filter import PASTED, PasteFilter
from terminal_helpers import TerminalProcess

#: 100 kB of any bytes, whole and half characters and sequences among them; but for those that the
#: terminal itself makes signals of.
GARBAGE = bytes(byte for byte in random.Random(9).randbytes(60_000) if byte not in b'\x03\x1a\x1c')
GARBAGE += 1000 * b'\x1b[1;5A\xe2\x82 dtsn \x1b]0;title\x07\xf0\x9f\x99' + 10_000 * b'd'


class TestPasteFilter:
    @given(st.lists(st.sampled_from('idtsn k'), max_size=8))
    def test_what_fingers_do_is_typed(self, keys):
        assert PasteFilter().filter(keys, 1.0) == (keys, False)

    def test_the_repeats_of_a_held_key_are_typed_also_after_a_while_without_a_look(self):
        assert PasteFilter().filter(300 * ['i'], 1.0) == (300 * ['i'], False)

    @pytest.mark.parametrize('keys', [10 * ['d', 't'], 2000 * ['i']])
    def test_what_nobody_types_is_left_out_until_it_is_quiet(self, keys):
        paste_filter = PasteFilter()
        assert paste_filter.filter(keys, 1.0) == ([], True)
        assert paste_filter.filter(['d'], 1.02) == ([], False)
        assert paste_filter.filter([], 1.3) == ([], False)
        assert paste_filter.filter(['i'], 1.4) == (['i'], False)

    def test_what_the_terminal_marks_is_left_out_however_short(self):
        paste_filter = PasteFilter()
        keys = ['i', PASTE_BEGINS, 'd', PASTE_ENDS, 'k']
        assert paste_filter.filter(keys, 1.0) == (['i', 'k'], True)
        assert paste_filter.filter([PASTE_BEGINS, 'd'], 2.0) == ([], True)
        assert paste_filter.filter(['d'], 2.5) == ([], False)
        assert paste_filter.filter([PASTE_ENDS], 2.6) == ([], False)
        assert paste_filter.filter(['i'], 2.7) == (['i'], False)

    def test_an_end_that_never_comes_is_not_waited_for_for_ever(self):
        paste_filter = PasteFilter()
        paste_filter.filter([PASTE_BEGINS, 'd'], 1.0)
        assert paste_filter.filter(['i'], 4.0) == (['i'], False)


@given(st.binary(max_size=300))
def test_no_bytes_hold_up_the_keys_after_them(data):
    parser = KeyParser()
    parser.feed(data, 1.0)
    parser.feed(b'', 2.0)
    assert parser.feed(b'i', 3.0) == ['i']


class Others:
    """The learner, the controller and the robot: hears what is asked of them."""

    def __init__(self, node):
        self.node, self.asked, self.speeds = node, set(), []
        node.create_subscription(Twist, 'cmd_vel_teleop', lambda msg: self.speeds.append(
            velocity_from_twist(msg)), 50)
        for name in ('run_trials', 'drop_last', 'undo', 'discard_demonstration',
                     'label_success', 'label_failure'):
            self._serve(Trigger, f'learner_node/{name}')
        self._serve(SetBool, 'learner_node/record_demonstration')

    def _serve(self, kind, name):
        def answer(_, response):
            self.asked.add(name)
            response.success = True
            return response
        self.node.create_service(kind, name, answer)

    def wait(self, predicate, process, what):
        ros_helpers.wait_until(predicate, node=self.node, processes=[process], what=what)


@pytest.mark.parametrize('marks', [(b'', b''), (PASTE_BEGINS.encode(), PASTE_ENDS.encode())],
                         ids=['as it is', 'marked'])
def test_pasted_garbage_moves_nothing_asks_for_nothing_and_leaves_the_terminal_whole(
    ros_node, tmp_path, marks,
):
    others = Others(ros_node)
    command = ros_helpers.node_command('teleop_node.node', tmp_path)
    with TerminalProcess(command, tmp_path, name='teleop_node') as process:
        others.wait(lambda: 'm/s' in process.read() and ros_node.count_publishers(
            'cmd_vel_teleop'), process, 'the line')
        pasted = marks[0] + GARBAGE + marks[1]
        for start in range(0, len(pasted), 2000):
            process.paste(pasted[start:start + 2000])
            ros_helpers.spin_some(ros_node, 0.005)
            process.read()
        others.wait(lambda: PASTED in process.read(), process, 'the word of it')

        def moves():
            process.type('i')
            ros_helpers.spin_some(ros_node, 0.05)
            return any(speed != (0.0, 0.0) for speed in others.speeds)

        others.wait(lambda: process.is_read, process, 'the end of the paste')
        assert not any(speed != (0.0, 0.0) for speed in others.speeds)
        assert others.asked == set()
        others.wait(moves, process, 'a robot that is driven again')
        process.type(ESCAPE)
        others.wait(lambda: process.popen.poll() is not None, process, 'the end')
        assert process.wait() == 0
        assert process.mode() == process.before
        assert process.read().endswith('\x1b[?2004l')
        assert 'Traceback' not in process.read() + process.stderr
