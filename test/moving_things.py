"""A controller's bench with something that comes into the way of its robot, and goes."""

from dataclasses import replace

import numpy as np

from controller_bench import Bench, GOAL
from controller_helpers import GRID, straight_field


def remembering(**options):
    """Return a bench whose robot remembers open ground and drives over it."""
    bench = Bench(field=False, **options)
    known = np.zeros(GRID.shape, np.int8)
    bench.supervisor.accept_field(replace(straight_field(GOAL), known=known))
    return bench.start()


def block(bench, *cells):
    for cell in cells:
        bench.world[cell] = 100


def clear(bench):
    bench.world[:] = 0


def wait_until(bench, is_so, seconds=20.0):
    end = bench.now + seconds
    while not is_so():
        assert bench.now < end, bench.supervisor.status
        bench.tick()


def is_waiting(bench):
    return bool(bench.supervisor.trial.run.waiting)


def waiting(bench=None, cell=(5, 5)):
    """Return a bench whose robot waits for what has come into its way."""
    bench = bench or remembering()
    block(bench, cell)
    wait_until(bench, lambda: is_waiting(bench))
    return bench
