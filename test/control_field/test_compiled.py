"""The compiled kernels where no cache can be written, and what those make that make no arrays."""

from pathlib import Path
import shutil
import sys

from numba.core.runtime import _nrt_python as runtime
from numba.core.runtime import rtsys
import numpy as np
import pytest

import control_field
from control_field.kernels import compiled
from control_field.kernels.steps import StepRules
from kernel_scenes import Scene
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


LEAN = sorted(name for name, kernel in compiled._ALL.items() if not kernel.targetoptions['_nrt'])
#: What may be called from Python: none of those that take a generator is.
CALLED = [name for name in LEAN if 'rng' not in compiled._ALL[name].py_func.__code__.co_varnames]


@pytest.fixture
def counted():
    """Count what compiled code allocates and frees."""
    runtime.memsys_enable_stats()
    yield rtsys.get_allocation_stats
    runtime.memsys_disable_stats()


def test_judging_makes_no_arrays():
    assert {'run_one', 'see_and_decide', 'rehearse_locally', 'look_around', 'take_in_cell',
            'put_back', 'share', 'step_allowed', 'enter'} <= set(LEAN)
    assert {'cost_to_go', 'window_values', 'choose', 'new_search'}.isdisjoint(LEAN)


@pytest.mark.parametrize('name', [*CALLED, *sorted(compiled._COUNTING)])
def test_what_counts_no_references_leaves_nothing_behind(name, counted):
    for seed in range(5):
        known = np.random.default_rng(seed).choice(np.array([0, 0, 100, -1], np.int8), (6, 7))
        arguments = Scene(known, StepRules(False, False, 8), seed).arguments(name)
        before = counted()
        getattr(compiled, name)(*arguments)
        after = counted()
        assert after.alloc - before.alloc == after.free - before.free
