from dataclasses import dataclass, fields

import pytest
from rclpy.parameter import Parameter

from control_field.parameters import check_fields, parameter, Parameters
from control_field_node.settings import Settings
from msgs_bridge.node.ros_parameters import declare_parameters_from, descriptor_from_field
import ros_helpers


@dataclass(frozen=True)
class Engine:
    power: float = parameter(2.0, 'how strong', unit='kW', low=0.5, high=16.0)
    gears: int = parameter(4, 'how many', low=1, high=10)
    fuel: str = parameter('hay', 'what it eats', choices=('hay', 'oats'))
    runs: bool = parameter(True, 'whether it runs')

    def __post_init__(self):
        check_fields(self)


@pytest.fixture
def engine_room(ros_domain):
    def make(**overrides):
        return ros_helpers.own_node(ros_domain, parameter_overrides=[
            Parameter(name, value=value) for name, value in overrides.items()])
    return make


def test_defaults_come_from_the_dataclass(engine_room):
    with engine_room() as node:
        assert declare_parameters_from(node, Engine) == Engine()
        assert node.get_parameter('fuel').value == 'hay'


def test_overrides_are_taken_and_a_whole_number_may_stand_for_a_float(engine_room):
    with engine_room(power=3, fuel='oats') as node:
        engine = declare_parameters_from(node, Engine)
    assert engine == Engine(power=3.0, fuel='oats')
    assert isinstance(engine.power, float)


@pytest.mark.parametrize(('name', 'value'), [
    ('power', 17.0), ('power', float('nan')), ('power', 'strong'), ('gears', 0), ('gears', 1.5),
    ('fuel', 'coal'), ('runs', 1)])
def test_a_wrong_value_at_start_is_one_line_that_names_it(engine_room, name, value):
    with engine_room(**{name: value}) as node:
        with pytest.raises(ValueError, match=name) as caught:
            declare_parameters_from(node, Engine)
    assert '\n' not in str(caught.value)


def test_a_change_at_run_time_is_checked_and_then_handed_over(engine_room):
    seen = []
    with engine_room() as node:
        declare_parameters_from(node, Engine, on_change=seen.append)
        refused = node.set_parameters([Parameter('gears', value=11)])[0]
        assert not refused.successful
        assert '10' in refused.reason
        coal = node.set_parameters([Parameter('fuel', value='coal')])[0]
        assert 'hay, oats' in coal.reason
        assert seen == []
        node.set_parameters([Parameter('gears', value=5)])
        node.set_parameters([Parameter('power', value=1)])
    assert seen == [Engine(gears=5), Engine(gears=5, power=1.0)]


def test_fixed_ones_cannot_be_changed_and_unnamed_ones_are_not_declared(engine_room):
    with engine_room() as node:
        declare_parameters_from(node, Engine, names=('power', 'gears'), fixed=('gears',))
        assert not node.set_parameters([Parameter('gears', value=5)])[0].successful
        assert not node.has_parameter('fuel')


def test_two_records_on_one_node_do_not_mix(engine_room):
    changes = []
    with engine_room() as node:
        declare_parameters_from(node, Engine, names=('gears',), on_change=changes.append)
        declare_parameters_from(node, Parameters, names=('seed', 'moves'))
        assert node.set_parameters([Parameter('seed', value=7)])[0].successful
        assert not node.set_parameters([Parameter('moves', value=5)])[0].successful
    assert changes == []


@pytest.mark.parametrize('kind', [Parameters, Settings])
def test_every_parameter_is_described_with_its_range(kind):
    for spec in fields(kind):
        descriptor = descriptor_from_field(spec)
        assert len(descriptor.description) > 10
        if type(spec.default) in (int, float):
            ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
            assert ranges[0].from_value <= spec.default <= ranges[0].to_value
