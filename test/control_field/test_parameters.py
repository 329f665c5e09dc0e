from dataclasses import fields
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from control_field.parameters import Parameters
from strategies import steady, taught

NUMBERS = [spec for spec in fields(Parameters) if spec.type in ('float', 'int', float, int)]


def test_every_parameter_says_what_it_is_and_its_default_is_in_range():
    Parameters()
    for spec in fields(Parameters):
        assert spec.metadata['meaning']
        assert spec.metadata['unit']


@pytest.mark.parametrize('spec', NUMBERS, ids=lambda spec: spec.name)
def test_out_of_range_is_refused_with_name_value_and_range(spec):
    low, high = spec.metadata['low'], spec.metadata['high']
    for bad in (low - 1, high + 1, math.nan, math.inf, -math.inf):
        with pytest.raises(ValueError, match=f'^{spec.name} is ') as caught:
            Parameters(**{spec.name: bad})
        if isinstance(bad, type(low)) and math.isfinite(bad):
            assert str(bad) in str(caught.value)
            assert f'between {low} and {high}' in str(caught.value)
            assert '[1]' not in str(caught.value)


@pytest.mark.parametrize('spec', fields(Parameters), ids=lambda spec: spec.name)
def test_the_wrong_type_is_refused(spec):
    wrong = 1 if spec.type in ('bool', bool) else True
    for bad in (None, [], wrong, '8' if spec.type not in ('str', str) else 8):
        with pytest.raises(ValueError, match=f'{spec.name} is .*must be'):
            Parameters(**{spec.name: bad})


@pytest.mark.parametrize('spec', NUMBERS, ids=lambda spec: spec.name)
def test_the_ends_of_a_range_belong_to_it(spec):
    for value in (spec.metadata['low'], spec.metadata['high']):
        assert getattr(Parameters(profile='paper', **{spec.name: value}), spec.name) == value


def test_from_mapping_keeps_defaults_and_names_strangers():
    assert Parameters.from_mapping({}) == Parameters()
    assert Parameters.from_mapping({'power': 3}).power == 3
    with pytest.raises(ValueError, match=r'powr is no parameter; there are: .*power'):
        Parameters.from_mapping({'powr': 3.0})


@pytest.mark.parametrize('moves', [5, 6, 7])
def test_moves_are_4_or_8(moves):
    with pytest.raises(ValueError, match='4 or 8'):
        Parameters(moves=moves)


def test_profiles_are_named():
    with pytest.raises(ValueError, match='must be one of paper, full'):
        Parameters(profile='best')


@pytest.mark.parametrize('discount', [0.0, 0.49, 0.99999, 1.0])
def test_rehearsal_needs_a_discount_it_can_take_a_logarithm_to(discount):
    with pytest.raises(ValueError, match=r'^discount is .*between 0.5 and 0.9999'):
        Parameters(discount=discount)
    Parameters(discount=discount, rehearsal=False)
    Parameters(discount=discount, profile='paper')


@steady
@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.5, 16.0), st.floats(1.0, 1000.0),
       st.booleans())
def test_every_allowed_number_gives_a_field(discount, rate, power, window, rehearsal):
    if rehearsal:
        discount = 0.5 + 0.4999 * discount
    for profile in ('paper', 'full'):
        learner = taught([(0, 0), (1, 1), (1, 2)], (4, 5), discount=discount, learning_rate=rate,
                         power=power, effective_window=window, rehearsal=rehearsal,
                         profile=profile)
        assert learner.refresh.certificate.fidelity == 1.0
