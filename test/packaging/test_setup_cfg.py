"""`make check` sees what ament's linters would say of imports and blank lines."""

import subprocess
import sys

import pytest

from ros_helpers import ROOT


@pytest.mark.parametrize(('source', 'code'), [
    ('import sys\nimport os\n', 'I100'),
    ('class A:\n    """Say."""\n\n    x = 1\n    def y(self):\n        pass\n', 'E301'),
    ('X = 1\ndef y():\n    pass\n', 'E302'),
    ('X = 1\n\n\n\nY = 2\n', 'E303'),
])
def test_flake8_names_it(source, code):
    done = subprocess.run(
        [sys.executable, '-m', 'flake8', '--config', 'setup.cfg', '-'], input=source, cwd=ROOT,
        capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert code in done.stdout
