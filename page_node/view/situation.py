"""How things stand, as one value: what the page shows as `state`, and advice is made from."""

from dataclasses import dataclass
from typing import Final

from control_field.robot.collision_monitor import Intervention
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.status import Status

#: What the page calls a reason that it has no words for.
OTHER: Final = 'other'
#: Before the first.
NO_TRIAL: Final = TrialStatus(State.IDLE)


@dataclass(frozen=True)
class Situation:
    """
    How things stand.

    Parameters
    ----------
    status : Status
        Of learner and trial.
    trial : TrialStatus
        The newest.
    has_robot, has_learner, has_controller : bool
        Whether something was heard of them lately.
    is_simulated : bool
        Whether the robot may be set somewhere.
    conflict : str
        What does not fit among the nodes, with its remedy; empty if all does.
    is_driven : bool
        Whether somebody drives.
    is_stuck : bool
        Whether it is driven for a while and does not move.
    has_moved : bool
        Whether it has moved since the recording began.
    tries_left : int
        Trials that a person wants yet of a real robot, which has to be driven back for each.
    has_waited : bool
        Whether the next trial waits for longer than it takes to look around.
    doing : str
        What the learner is at, in its words.
    ended : str
        Why the recording of a drive has ended that nobody kept, as a code; empty where none did.
    n_places : int
        Places where one more drive would help.
    n_episodes : int
        Bags of the task.
    has_other_cells : bool
        Whether what conflicts are cells: what was learnt is of others than the world has.

    """

    status: Status
    trial: TrialStatus = NO_TRIAL
    has_robot: bool = False
    has_learner: bool = False
    has_controller: bool = False
    is_simulated: bool = False
    conflict: str = ''
    is_driven: bool = False
    is_stuck: bool = False
    has_moved: bool = False
    tries_left: int = 0
    has_waited: bool = False
    doing: str = ''
    ended: str = ''
    n_places: int = 0
    n_episodes: int = 0
    has_other_cells: bool = False

    @property
    def is_learnt(self) -> bool:
        """Whether there is a field to try."""
        return self.status.prototypes >= 0

    @property
    def held(self) -> str:
        """Return the name of why the robot is held; empty if it is not."""
        return reason_held(self.status.held)


def reason_held(sentence: str) -> str:
    """Return the name of the collision monitor's reason that begins a sentence."""
    if not sentence:
        return ''
    return next((str(each) for each in Intervention
                 if each.sentence and sentence.startswith(each.sentence)), OTHER)
