"""`make bench` measures, and fails when a promise is not kept."""

import dataclasses
from pathlib import Path
import sys

import pytest

from benchmarks import speed

ROOT = Path(__file__).parents[2]


def test_what_make_bench_measures(monkeypatch, capsys):
    monkeypatch.setattr(sys, 'argv', ['speed', '32', 'refresh, 20'])
    assert speed.main() == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split('  ')[0] for line in lines] == ['refresh, 20 x 20', 'certificate, 32 x 32']
    assert all(float(line.split()[-5]) > 0.0 for line in lines)


def test_a_promise_that_is_not_kept(monkeypatch, capsys):
    monkeypatch.setattr(speed, 'CASES', [
        dataclasses.replace(speed.CASES[2], limit=1e-9)])
    monkeypatch.setattr(sys, 'argv', ['speed'])
    assert speed.main() == 1
    assert 'promised 1e-06 ms' in capsys.readouterr().out


@pytest.mark.parametrize('target', ['bench', 'evaluation'])
def test_the_module_behind_a_target_exists(target):
    recipe = (ROOT / 'Makefile').read_text().split(f'\n{target}: tools\n')[1].splitlines()[0]
    module = recipe.split('-m ')[1].split()[0]
    assert (ROOT / module.replace('.', '/')).with_suffix('.py').is_file()
