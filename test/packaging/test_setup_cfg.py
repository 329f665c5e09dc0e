"""`make check` sees what ament's linters would say, and what may run code from a file."""

from configparser import ConfigParser
from pathlib import Path
import subprocess
import sys

from ros_helpers import ROOT


def test_flake8_names_it(tmp_path):
    sources = {
        'I100': 'import sys\nimport os\n',
        'E301': 'class A:\n    """Say."""\n\n    x = 1\n    def y(self):\n        pass\n',
        'E302': 'X = 1\ndef y():\n    pass\n', 'E303': 'X = 1\n\n\n\nY = 2\n'}
    for code, source in sources.items():
        (tmp_path / f'{code}.py').write_text(source)
    done = subprocess.run(
        [sys.executable, '-m', 'flake8', '--config', 'setup.cfg', str(tmp_path)], cwd=ROOT,
        capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    for code in sources:
        assert any(f'{code}.py:' in line and f': {code} ' in line
                   for line in done.stdout.splitlines()), code


def test_flake8_knows_what_is_ours():
    config = ConfigParser()
    config.read(ROOT / 'setup.cfg')
    names = config['flake8']['application-import-names'].split(',')
    rooms = {path.parent.name for path in ROOT.glob('*/__init__.py')}
    helpers = {path.stem for path in ROOT.glob('test/*.py')} - {'conftest'}
    assert sorted(names) == sorted(rooms | helpers | {'tools'})


def test_ruff_names_what_may_run_code_from_a_file():
    source = """
import os
import subprocess
import yaml
import pickle
import joblib
eval(x)
exec(x)
os.system(x)
yaml.load(x, yaml.Loader)
subprocess.run(x, shell=True)
"""
    done = subprocess.run(
        [Path(sys.executable).with_name('ruff'), 'check', '--output-format=concise',
         '--stdin-filename=control_field/a.py', '-'], input=source, cwd=ROOT,
        capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    for line, code in enumerate(['TID251', 'TID251', 'S307', 'S102', 'S605', 'S506', 'S602'], 5):
        assert f'control_field/a.py:{line}:' in done.stdout
        assert f' {code} ' in done.stdout
