"""
The kernels compiled by numba, for the learner's side; the robot never imports this.

Every function of the kernel modules is there under its own name.
"""

from collections.abc import Callable
import dis
import hashlib
import inspect
import sys
import types
from typing import Any, Final, get_args

import numba

from control_field.kernels import (
    decision, interpolation, judging, last_resort, local_search, moving_world, queues,
    rehearsal, repair, rollout, seen, sharing, steps, trials, visibility, waiting)

#: Kernels of these that make no arrays count no references to those they are given: that took a
#: third of the time of judging.
_LEAN: Final = (steps, queues, local_search, visibility, rollout, last_resort, decision, trials,
                sharing, judging)
#: By what a kernel makes arrays; numba refuses to compile one of `_LEAN` that does it otherwise.
_MAKING: Final = frozenset({'zeros', 'empty', 'full', 'ones', 'copy', 'sum'})
#: These count all the same: those called from Python with a generator of random numbers, which is
#: never let go of else, and one that copies an array as a whole.
_COUNTING: Final = frozenset({'judge', 'least_chosen', 'run_alone', 'run_trial', 'write_shown'})
#: What is compiled under the name of a kernel that plain Python has in NumPy expressions.
_INSTEAD = {'doubt_unseen': last_resort.doubt_unseen_by_cells}


def _compile(*modules: types.ModuleType) -> dict[str, Callable[..., Any]]:
    """Compile the functions of modules so that they call each other compiled."""
    # numba's cache looks at a function's own file only; the digest of all of them in the name
    # keeps it from serving code that calls what has since been changed elsewhere, or how it is
    # compiled.
    sources = ''.join(inspect.getsource(module) for module in (*modules, sys.modules[__name__]))
    digest = hashlib.sha256(sources.encode()).hexdigest()[:12]
    namespace: dict[str, Any] = {}
    compiled: dict[str, Callable[..., Any]] = {}
    making = set[str]()
    for module in modules:
        namespace.update({k: v for k, v in vars(module).items() if k not in compiled})
        for name, function in list(vars(module).items()):
            if isinstance(function, types.FunctionType) and function.__module__ == module.__name__:
                assert name not in compiled, f'two kernels are called {name}'
                source = _INSTEAD.get(name, function)
                rebound = types.FunctionType(source.__code__, namespace, name,
                                             function.__defaults__)
                rebound.__module__ = module.__name__
                rebound.__qualname__ = f'{name}_{digest}'
                if _holds_arrays(function.__annotations__['return']):
                    making.add(name)
                counts = (module not in _LEAN or name in making or name in _COUNTING
                          or _makes_arrays(source, making))
                compiled[name] = namespace[name] = _jit(rebound, counts)
    return compiled


def _makes_arrays(function: Any, making: set[str]) -> bool:
    """Return whether a kernel makes arrays, or calls one of those that do."""
    return not _MAKING.isdisjoint(function.__code__.co_names) or any(
        step.opname == 'LOAD_GLOBAL' and step.argval in making
        for step in dis.get_instructions(function))


def _holds_arrays(kind: Any) -> bool:
    """Return whether what a kernel returns is, or holds, an array."""
    parts = get_args(kind) or tuple(getattr(kind, '__annotations__', {}).values())
    return any(map(_holds_arrays, parts)) if parts else kind not in (int, float, bool, None)


def _jit(function: types.FunctionType, counts: bool) -> Callable[..., Any]:
    """Compile a function, which counts references to arrays or does not."""
    options: dict[str, Any] = {'nogil': True, '_nrt': counts}
    try:
        kernel: Callable[..., Any] = numba.njit(cache=True, **options)(function)
    except RuntimeError:
        # There is no folder to write a cache to: a service's user without a home, and a package
        # that belongs to root. Then it is compiled at every start.
        kernel = numba.njit(**options)(function)
    return kernel


#: A module comes after those that it calls.
_ALL = _compile(
    steps, queues, local_search, rehearsal, seen, visibility, rollout, last_resort, decision,
    trials, sharing, judging, waiting, moving_world, interpolation, repair)


def __getattr__(name: str) -> Callable[..., Any]:
    """Return a compiled kernel."""
    try:
        return _ALL[name]
    except KeyError:
        raise AttributeError(f'no kernel is called {name}') from None
