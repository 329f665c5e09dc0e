"""The tables of parameters say what is taken, and what can be changed at run time."""

from dataclasses import fields

import pytest

from control_field.parameters import Parameters
from tools.parameter_tables import limits_of, page


@pytest.mark.parametrize(('name', 'limits'), [
    ('moves', '4 or 8'), ('oscillation_limit', '1 to 1000'), ('profile', '`paper`, `full`'),
    ('discount', '0 to 1'), ('corner_cutting', '')])
def test_a_range_holds_only_what_is_taken(name, limits):
    [spec] = [spec for spec in fields(Parameters) if spec.name == name]
    assert limits_of(spec, Parameters) == limits


def test_it_is_said_where_the_parameters_of_learning_are_fixed():
    section = page().split('## Learning')[1].split('##')[0]
    assert 'All are fixed on `learner_node`' in section
    assert 'on `control_field_node` they can be changed at run time' in section
