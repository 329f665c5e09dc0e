"""ROS parameters declared from a dataclass: one description for the core and for `ros2 param`."""

from collections.abc import Callable, Collection
from dataclasses import Field, fields, replace
import math
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult)
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from control_field.parameters import check_fields, check_value

Record = TypeVar('Record')


def declare_parameters_from(
    node: Node, kind: type[Record], *, names: Collection[str] | None = None,
    fixed: Collection[str] = (), on_change: Callable[[Record], None] | None = None,
) -> Record:
    """
    Declare the fields of a dataclass as parameters of a node, and watch over them.

    A change at run time is checked before it is made: out of range, it is refused with the range
    named; else ``on_change`` gets the new record once it is made.

    Parameters
    ----------
    node : Node
        Whose parameters they become.
    kind : type
        A frozen dataclass whose fields are made by `control_field.parameters.parameter`.
    names : collection of str, optional
        The fields to declare; the others keep their defaults. All of them by default.
    fixed : collection of str
        Fields that cannot be changed at run time.
    on_change : callable, optional
        Called with the new record after a change.

    Returns
    -------
    record
        With the values the node was started with.

    Raises
    ------
    ValueError
        If such a value is of the wrong type or out of range: one line that names it.

    """
    specs = [spec for spec in fields(kind)  # type: ignore[arg-type]
             if names is None or spec.name in names]
    values = {spec.name: _declare(node, spec, spec.name in fixed) for spec in specs}
    record = _checked(kind(**values))
    _watch(node, [record], {spec.name: spec for spec in specs}, on_change)
    return record


def descriptor_from_field(spec: 'Field[Any]', read_only: bool = False) -> ParameterDescriptor:
    """Write what a field's metadata says about meaning, unit, range and choices."""
    meta = spec.metadata
    text = meta['meaning'] + (f' [{meta["unit"]}]' if meta['unit'] != '1' else '')
    if meta['choices']:
        text += f' (one of {", ".join(meta["choices"])})'
    # Types are checked by the record itself, so that a whole number may stand for a float.
    descriptor = ParameterDescriptor(
        name=spec.name, description=text, read_only=read_only, dynamic_typing=True)
    low, high = meta['low'], meta['high']
    if isinstance(spec.default, float) and math.isfinite(low) and math.isfinite(high):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(low), to_value=float(high))]
    elif type(spec.default) is int and math.isfinite(low) and math.isfinite(high):
        descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    return descriptor


def _declare(node: Node, spec: 'Field[Any]', read_only: bool) -> Any:
    try:
        return _as_declared(spec, node.declare_parameter(
            spec.name, spec.default, descriptor_from_field(spec, read_only)).value)
    except ParameterException as error:
        # ROS looks at ranges first, in words of its own; ours name parameter, value and range.
        given = node._parameter_overrides.get(spec.name)
        check_value(spec, spec.default if given is None else given.value)
        raise ValueError(f'{spec.name}: {_one_line(str(error))}') from None


def _as_declared(spec: 'Field[Any]', value: Any) -> Any:
    """Return a value, a whole number as the float it stands for."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if whole and isinstance(spec.default, float) else value


def _one_line(text: str) -> str:
    return ' '.join(text.split())


def _checked(record: Record) -> Record:
    check_fields(record)
    return record


def _watch(
    node: Node, current: list[Record], specs: 'dict[str, Field[Any]]',
    on_change: Callable[[Record], None] | None,
) -> None:
    """Refuse what is out of range, take over what is not."""
    def changed(parameters: list[Parameter]) -> Record:
        values = {p.name: _as_declared(specs[p.name], p.value)
                  for p in parameters if p.name in specs}
        return _checked(replace(current[0], **values))  # type: ignore[type-var]

    def validate(parameters: list[Parameter]) -> SetParametersResult:
        try:
            changed(parameters)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def apply(parameters: list[Parameter]) -> None:
        if any(p.name in specs for p in parameters):
            current[0] = changed(parameters)
            if on_change is not None:
                on_change(current[0])

    node.add_on_set_parameters_callback(validate)
    node.add_post_set_parameters_callback(apply)
