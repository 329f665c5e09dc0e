"""How teaching stands, as one value."""

from dataclasses import dataclass
import math

from control_field.robot.limits import Velocity


@dataclass(frozen=True)
class Status:
    """
    What the line says.

    Parameters
    ----------
    phase : str
        Of the learner; empty where there is none.
    seconds : float, [s]
        How long a demonstration has been recorded.
    trials_left : int
        Trials that are still to be run.
    trial : int
        Number of the last trial, 0 before the first.
    trial_state : str
        ``running``, ``paused`` or ``ended``.
    outcome : str
        How it ended.
    reason : str
        Why it was paused or stopped.
    steps : int
        Of that trial.
    prototypes : int
        Of the field in force, -1 without one.
    basin, fidelity : float, 0 to 1
        Of its certificate, NaN without one.
    speeds : tuple of float, [m/s] and [rad/s]
        Of the keys.
    problem : str
        What a person has to mend before the robot moves.
    held : str
        Why the collision monitor lets it stand that is told to drive.
    bag : str
        In which the last trial is recorded; empty where that is not known.

    """

    phase: str = ''
    seconds: float = 0.0
    trials_left: int = 0
    trial: int = 0
    trial_state: str = ''
    outcome: str = ''
    reason: str = ''
    steps: int = 0
    prototypes: int = -1
    basin: float = math.nan
    fidelity: float = math.nan
    speeds: Velocity = (0.0, 0.0)
    problem: str = ''
    held: str = ''
    bag: str = ''
