"""Whether the controller has the field of this learner, or one that a stranger has published."""

from typing import Final

from learner_node.session.inputs import is_running
from msgs_bridge.messages.trial_status import TrialStatus

#: After so many looks in a row that find another field there ours is published anew; who refuses
#: it is not to be asked for ever. One that was there before ours may only be there yet: a large
#: field takes its time.
_AGAIN: Final = (3, 6, 12)
_AGAIN_IF_AS_BEFORE: Final = (30, 60, 120)


class FieldMonitor:
    """
    Notices that the controller, at rest, has another field than the one this learner published.

    A second learner that meets this one leaves its own field there when it goes, or a void one,
    and the controller keeps what came last.
    """

    def __init__(self) -> None:
        """Start with nothing found."""
        self.must_publish = False  #: whether the field is to be published once more
        self._own: tuple[int, str] | None = None
        self._found: tuple[int, str] | None = None
        self._before: tuple[int, str] | None = None
        self._n_looks = 0

    def look(
        self, status: TrialStatus | None, revision: int, memory: str, is_alone: bool,
    ) -> None:
        """
        Compare the controller's field with the own one; call it about once a second.

        Parameters
        ----------
        status : TrialStatus or None
            Newest word of the controller.
        revision : int
            Of the published field; negative where nothing was learnt.
        memory : str
            Whose field that is.
        is_alone : bool
            Whether no second learner is there, which would do the same.

        """
        own = revision, memory
        found = None if status is None else (status.revision, status.memory)
        if own != self._own:
            self._own, self._before = own, self._found
        self._n_looks = self._n_looks + 1 if found == self._found else 1
        self._found = found
        if found == own:
            self._before = None
        is_other = found not in (None, own) and status is not None and status.revision >= 0
        if revision < 0 or not is_alone or is_running(status) or not is_other:
            self._n_looks = 0
        self.must_publish = self._n_looks in (
            _AGAIN_IF_AS_BEFORE if found == self._before else _AGAIN)
