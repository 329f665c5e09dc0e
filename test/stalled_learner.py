"""The learner, whose worker and executor stand still for some seconds once it records."""

import ctypes
import time

from learner_node.node import LearnerNode
from learner_node.reports import PROGRAM
from msgs_bridge.node.run import run_node

#: How long each of them stands still, and for how long nothing of Python runs at all, [s].
STALL, FROZEN = 5.0, 1


class StalledLearner(LearnerNode):
    """Stands still once."""

    def __init__(self):
        super().__init__()
        self._stalls = self.create_timer(0.1, self._stall)

    def _stall(self):
        if self._recorder.kind is None:
            return
        self._stalls.cancel()
        print('stalls', flush=True)
        # A call that holds Python's lock, as a library may; then both threads for themselves.
        self.learning.worker.do(
            lambda: ctypes.PyDLL(None).sleep(FROZEN) or time.sleep(STALL - FROZEN),
            lambda future: None)
        time.sleep(STALL)
        print('goes on', flush=True)


def main():
    """Run it until a signal comes."""
    run_node(PROGRAM, StalledLearner)
