"""What a page asks of the learner goes there and comes back, and nothing else is read."""

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters

from msgs_bridge.messages.learner_requests import (
    action_from_request, answer_from_response, fill_response, request_from_action)

TEXTS = st.text(min_size=1, max_size=40)


@given(TEXTS, st.fixed_dictionaries(
    {}, optional={'episode': TEXTS, 'n': st.integers(-2**63, 2**63 - 1)}))
def test_a_request_there_and_back(action, values):
    assert action_from_request(request_from_action(action, values)) == (action, values)


@given(st.booleans(), TEXTS, st.text(max_size=40))
def test_an_answer_there_and_back(success, message, code):
    response = fill_response(SetParameters.Response(), success, message, code)
    assert answer_from_response(response) == (success, message, code)


def a_request(**values):
    return SetParameters.Request(
        parameters=[Parameter(name=name, value=value) for name, value in values.items()])


def text(value):
    return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)


def number(value):
    return ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=value)


@pytest.mark.parametrize('request_', [
    a_request(), a_request(n=number(1)), a_request(action=number(3)), a_request(action=text('')),
    a_request(action=text('keep'), more=text('x')), a_request(action=text('keep'), n=text('3')),
    a_request(action=text('keep'), episode=ParameterValue(type=ParameterType.PARAMETER_BOOL))])
def test_what_is_no_request_is_refused(request_):
    with pytest.raises(ValueError, match=r'^request: '):
        action_from_request(request_)


@pytest.mark.parametrize('n', [0, 1, 3])
def test_what_is_no_answer_is_refused(n):
    with pytest.raises(ValueError, match='must be 2'):
        answer_from_response(SetParameters.Response(results=[SetParametersResult()] * n))
