"""What trials begin with, made before they are needed, in a thread that nobody waits for."""

from threading import Lock

from control_field.kernels.decision import TrialState
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.policy import trial_on


class ReadyStates:
    """Keeps the states of trials that have not begun: of the two fields that came last."""

    def __init__(self) -> None:
        """Start with none."""
        self._ready: list[tuple[ControlField, Parameters, TrialState]] = []
        self._lock = Lock()

    def make(self, field: ControlField, parameters: Parameters) -> None:
        """Make the state of a trial on a field, unless it is there."""
        if field.is_void or self.holds(field, parameters):
            return
        state = trial_on(field, field.known.copy(), parameters)
        with self._lock:
            others = [each for each in self._ready if each[0] is not field]
            self._ready = [*others[-1:], (field, parameters, state)]

    def holds(self, field: ControlField, parameters: Parameters) -> bool:
        """Return whether the state of a trial on a field is ready."""
        return any(each[0] is field and each[1] == parameters for each in self._ready)

    def take(self, field: ControlField, parameters: Parameters) -> TrialState | None:
        """Take the state of a trial on a field, the trial's own from now on; None if not ready."""
        with self._lock:
            for each in self._ready:
                if each[0] is field and each[1] == parameters:
                    self._ready = [other for other in self._ready if other is not each]
                    return each[2]
        return None
