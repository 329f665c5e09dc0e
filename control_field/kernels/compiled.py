"""
The kernels compiled by numba, for the learner's side; the robot never imports this.

Every function of the kernel modules is there under its own name.
"""

from collections.abc import Callable
import hashlib
import inspect
import types
from typing import Any

import numba

from control_field.kernels import (
    decision, interpolation, judging, last_resort, local_search, moving_world, rehearsal, repair,
    rollout, seen, sharing, steps, trials, visibility, waiting)

#: What is compiled under the name of a kernel that plain Python has in NumPy expressions.
_INSTEAD = {'doubt_unseen': last_resort.doubt_unseen_by_cells}


def _compile(*modules: types.ModuleType) -> dict[str, Callable[..., Any]]:
    """Compile the functions of modules so that they call each other compiled."""
    # numba's cache looks at a function's own file only; the digest of all of them in the name
    # keeps it from serving code that calls what has since been changed elsewhere.
    sources = ''.join(inspect.getsource(module) for module in modules)
    digest = hashlib.sha256(sources.encode()).hexdigest()[:12]
    namespace: dict[str, Any] = {}
    compiled: dict[str, Callable[..., Any]] = {}
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
                compiled[name] = namespace[name] = _jit(rebound)
    return compiled


def _jit(function: types.FunctionType) -> Callable[..., Any]:
    try:
        return numba.njit(cache=True, nogil=True)(function)
    except RuntimeError:
        # There is no folder to write a cache to: a service's user without a home, and a package
        # that belongs to root. Then it is compiled at every start.
        return numba.njit(nogil=True)(function)


#: A module comes after those that it calls.
_ALL = _compile(
    steps, local_search, rehearsal, seen, visibility, rollout, last_resort, decision, trials,
    sharing, judging, waiting, moving_world, interpolation, repair)


def __getattr__(name: str) -> Callable[..., Any]:
    """Return a compiled kernel."""
    try:
        return _ALL[name]
    except KeyError:
        raise AttributeError(f'no kernel is called {name}') from None
