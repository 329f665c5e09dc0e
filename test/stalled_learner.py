"""The learner, whose threads stand still: two once it records, then the third until it keeps."""

import ctypes
from threading import Event
import time

from learner_node.node import LearnerNode
from learner_node.reports import PROGRAM
from learner_node.session.phases import Phase
from msgs_bridge.node.run import run_node

#: How long each of them stands still, and for how long nothing of Python runs at all, [s].
STALL, FROZEN = 5.0, 1
#: How long the thread that records takes nothing once the drive is being kept, [s].
DEAF = 1.0


class StalledLearner(LearnerNode):
    """Stands still once."""

    def __init__(self):
        super().__init__()
        self._stalls = self.create_timer(0.1, self._stall)
        self._listener._group._ask = self._be_deaf
        self._went_on, self._is_kept = Event(), False

    def _be_deaf(self):
        """Take nothing from the middleware until the drive is kept, and for a while longer."""
        if self._went_on.is_set() and not self._is_kept:
            while (self._session.state.phase is Phase.DEMONSTRATION
                   and not self._listener._is_over.is_set()):
                time.sleep(0.01)
            time.sleep(DEAF)
            self._is_kept = True

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
        self._went_on.set()
        print('goes on', flush=True)


def main():
    """Run it until a signal comes."""
    run_node(PROGRAM, StalledLearner)
