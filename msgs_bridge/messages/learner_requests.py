"""
What a page asks of the learner, and its answer: a service that carries values and a code.

`~/request` is of the type rcl_interfaces/srv/SetParameters, the only standard one whose request
names values of any type and whose answer has texts: the parameters are the `action` and what it is
about, the results are what came of it with a sentence, and its code.
"""

from collections.abc import Mapping
from typing import Any, Final

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import SetParameters

Value = str | int
#: Name of the service, behind that of the learner.
SERVICE: Final = 'request'
_ACTION: Final = 'action'
#: Values that a request may have beside its action, by their type.
_VALUES: Final[Mapping[str, type[str] | type[int]]] = {'episode': str, 'n': int}


def request_from_action(action: str, values: Mapping[str, Value]) -> Any:
    """Write what is asked for, and what about."""
    return SetParameters.Request(parameters=[
        Parameter(name=name, value=_parameter_value(value))
        for name, value in {_ACTION: action, **values}.items()])


def _parameter_value(value: Value) -> ParameterValue:
    if isinstance(value, int):
        return ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=value)
    return ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)


def action_from_request(msg: Any) -> tuple[str, dict[str, Value]]:
    """
    Read what is asked for, and what about.

    Raises
    ------
    ValueError
        If there is no action, or a value that is not known or of another type.

    """
    action, values = '', dict[str, Value]()
    for parameter in msg.parameters:
        value: Any = _read(parameter.value)
        kind = _VALUES.get(parameter.name)
        if parameter.name == _ACTION and isinstance(value, str):
            action = value
        elif kind is not None and isinstance(value, kind):
            values[parameter.name] = value
        else:
            raise ValueError(f'request: {parameter.name[:40]!r} is none of its values, or of the '
                             f'wrong type; there are {_ACTION}, {", ".join(_VALUES)}')
    if not action:
        raise ValueError('request: it has no action')
    return action, values


def _read(value: Any) -> Any:
    if value.type == ParameterType.PARAMETER_INTEGER:
        return value.integer_value
    return value.string_value if value.type == ParameterType.PARAMETER_STRING else None


def fill_response(response: Any, success: bool, message: str, code: str) -> Any:
    """Write what came of it into the response of the service, and return that."""
    response.results = [SetParametersResult(successful=success, reason=text)
                        for text in (message, code)]
    return response


def answer_from_response(response: Any) -> tuple[bool, str, str]:
    """
    Return whether it was done, a sentence about it, and its code.

    Raises
    ------
    ValueError
        If these are not the two results.

    """
    if len(response.results) != 2:
        raise ValueError(f'request: {len(response.results)} results, must be 2')
    told, coded = response.results
    return told.successful, told.reason, coded.reason
