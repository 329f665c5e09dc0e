"""The compiled kernels where no cache can be written."""

from pathlib import Path
import shutil
import sys

import control_field
from ros_helpers import run

KERNEL = """
import numpy as np
from control_field.kernels import compiled
known = np.full((3, 3), -1, np.int8)
compiled.remember_local_grid(known, 1, 1, 1, 0)
print(compiled.__file__, known.tolist())
"""


def test_without_a_folder_for_the_cache_the_kernels_work(tmp_path):
    package = tmp_path / 'control_field'
    shutil.copytree(Path(control_field.__file__).parent, package,
                    ignore=shutil.ignore_patterns('__pycache__'))
    (package / 'kernels' / '__pycache__').touch()  # no folder, whoever runs this test
    nowhere = {'HOME': '/dev/null', 'XDG_CACHE_HOME': '/dev/null', 'NUMBA_CACHE_DIR': '',
               'PYTHONPATH': str(tmp_path)}
    process = run([sys.executable, '-B', '-c', KERNEL], tmp_path, nowhere, deadline=240.0,
                  cwd=tmp_path)
    assert process.popen.returncode == 0, process.report()
    assert process.stdout.split(maxsplit=1) == [
        str(package / 'kernels' / 'compiled.py'), '[[0, 0, 0], [0, 0, 100], [0, 0, 0]]\n']
