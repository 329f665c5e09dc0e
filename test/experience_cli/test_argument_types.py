"""Words on the command line: what is a number, a place, a speed, and what is said of others."""

import argparse

import pytest

from control_field.drives.plausibility import SPEED_MAX
from experience_cli.argument_types import count, distance, point, radius, speed
from experience_cli.arguments import parser

NUMBER = count(1, 10)


@pytest.mark.parametrize(('kind', 'text', 'value'), [
    (NUMBER, '1', 1), (NUMBER, '10', 10),
    (point, '1,2.5', (1.0, 2.5)), (point, '-1e3,0', (-1e3, 0)),
    (distance, '0', 0.0), (distance, '1.5', 1.5),
    (speed, '0.1', 0.1), (radius, '0', 0.0), (radius, '2', 2.0)])
def test_what_is_meant_is_read(kind, text, value):
    assert kind(text) == value


@pytest.mark.parametrize(('kind', 'text'), [
    *((NUMBER, text) for text in ('0', '11', '1.5', 'one', '')),
    *((point, text) for text in ('1', '1,2,3', 'nan,1', '1,inf', 'a,b', ',')),
    *((kind, text) for kind in (distance, speed, radius)
      for text in ('-1', 'nan', 'inf', 'far', '1,2', '1,nan', '')),
    (speed, '0'), (radius, '2.1')])
def test_what_is_not_is_named(kind, text):
    with pytest.raises(argparse.ArgumentTypeError) as refused:
        kind(text)
    assert str(refused.value).startswith(repr(text))


def test_the_speed_in_the_help_is_the_one_that_is_taken(capsys):
    with pytest.raises(SystemExit):
        parser().parse_args(['evaluate', '--help'])
    assert f'no robot (default: {SPEED_MAX:g} m/s)' in ' '.join(capsys.readouterr().out.split())
