"""The status on `trial`."""

from diagnostic_msgs.msg import DiagnosticStatus
from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.serialization import deserialize_message, serialize_message

from control_field.records import Outcome
from msgs_bridge.messages.trial_status import (
    Label, State, status_from_trial, trial_from_status, TrialStatus)

counts = st.integers(0, 2**32 - 1)


@st.composite
def statuses(draw):
    state = draw(st.sampled_from(State))
    outcome = draw(st.sampled_from(Outcome)) if state is State.ENDED else None
    return TrialStatus(
        state, draw(counts), outcome, draw(st.text(st.characters(codec='ascii'), max_size=30)
                                           .filter(lambda text: '\0' not in text)),
        draw(counts), draw(counts), draw(counts), draw(st.integers(-1, 9)),
        draw(st.floats(0, 2e9)), draw(st.sampled_from(Label)))


@given(statuses())
def test_round_trip(status):
    msg = status_from_trial(status, 'burger')
    over = deserialize_message(serialize_message(msg), DiagnosticStatus)
    assert trial_from_status(over) == status
    assert (over.name, over.hardware_id) == ('trial', 'burger')
    assert over.message == status.sentence


@pytest.mark.parametrize(('status', 'level', 'sentence'), [
    (TrialStatus(State.IDLE), DiagnosticStatus.STALE, 'no trial is running'),
    (TrialStatus(State.RUNNING, 3, steps=5), DiagnosticStatus.OK, 'trial 3 is running, 5 steps'),
    (TrialStatus(State.PAUSED, 3), DiagnosticStatus.WARN, 'trial 3 is paused, 0 steps'),
    (TrialStatus(State.ENDED, 3, Outcome.GOAL), DiagnosticStatus.OK,
     'trial 3 reached the goal in 0 steps'),
    (TrialStatus(State.ENDED, 3, Outcome.COLLISION, 'bump'), DiagnosticStatus.ERROR,
     'trial 3 ran into something after 0 steps: bump'),
    (TrialStatus(State.ENDED, 3, Outcome.GAVE_UP), DiagnosticStatus.WARN, 'gave up'),
    (TrialStatus(State.ENDED, 3, Outcome.STOPPED), DiagnosticStatus.WARN, 'stopped'),
], ids=lambda value: value.sentence if isinstance(value, TrialStatus) else '')
def test_level_and_sentence(status, level, sentence):
    assert status.level == level
    assert sentence in status.sentence


@pytest.mark.parametrize(('values', 'sentence'), [
    ({'trial': -1}, 'trial is -1, must be 0 or more'),
    ({'steps': 2**32}, 'steps is 4294967296'),
    ({'revision': -2}, 'revision is -2, must be -1 or more'),
    ({'stamp': float('nan')}, 'stamp is nan'),
    ({'stamp': float('inf')}, 'stamp is inf'),
    ({'stamp': -0.1}, 'stamp is -0.1'),
    ({'outcome': Outcome.GOAL}, 'state is running with outcome goal'),
    ({'state': State.ENDED}, 'state is ended with outcome empty'),
], ids=str)
def test_what_cannot_be(values, sentence):
    with pytest.raises(ValueError, match=f'trial: {sentence}'):
        TrialStatus(**{'state': State.RUNNING, **values})


@pytest.mark.parametrize(('key', 'value', 'sentence'), [
    ('state', 'flying', "state is 'flying', must be one of idle, running, paused, ended"),
    ('outcome', 'won', "outcome is 'won', must be one of goal"),
    ('trial', 'one', "trial is 'one', must be a number"),
    ('trial', '1' * 5000, 'must be a number'),
    ('stamp', 'nan', 'stamp is nan'),
    ('stamp', '', "stamp is '', must be a number"),
    ('label', 'good', "label is 'good', must be one of"),
])
def test_values_that_make_no_sense(key, value, sentence):
    msg = status_from_trial(TrialStatus(State.ENDED, 1, Outcome.GOAL, label=Label.SUCCESS))
    next(pair for pair in msg.values if pair.key == key).value = value
    with pytest.raises(ValueError, match=f'trial: .*{sentence}'):
        trial_from_status(msg)


def test_a_missing_value_and_another_status_are_refused():
    msg = status_from_trial(TrialStatus(State.RUNNING, 1))
    msg.values = msg.values[1:]
    with pytest.raises(ValueError, match='trial: value state is missing'):
        trial_from_status(msg)
    with pytest.raises(ValueError, match="name is 'battery', must be 'trial'"):
        trial_from_status(DiagnosticStatus(name='battery'))


def test_before_the_first_trial_nothing_has_been_counted():
    idle = TrialStatus(State.IDLE)
    assert (idle.trial, idle.steps, idle.decisions, idle.reinforcements) == (0, 0, 0, 0)
    assert (idle.revision, idle.stamp, idle.outcome) == (-1, 0.0, None)


def test_keys_that_are_not_known_are_passed_over():
    msg = status_from_trial(TrialStatus(State.RUNNING, 1))
    msg.values = [*msg.values, type(msg.values[0])(key='more', value='x')]
    assert trial_from_status(msg) == TrialStatus(State.RUNNING, 1)
