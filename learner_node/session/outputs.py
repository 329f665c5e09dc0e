"""The outputs of a session: what it wants done, in order."""

from dataclasses import dataclass

from control_field.poses import StartPose
from episode_store.task_folder import EpisodeKind


@dataclass(frozen=True)
class Record:
    """Begin a bag; what arrives from now on goes into it."""

    kind: EpisodeKind


@dataclass(frozen=True)
class Close:
    """Close the bag and learn from it."""


@dataclass(frozen=True)
class Abandon:
    """Close the bag without learning; with a reason, write that this trial was aborted."""

    reason: str
    trial: int = 0


@dataclass(frozen=True)
class Discard:
    """Remove the bag."""


@dataclass(frozen=True)
class Place:
    """Set the simulated robot to a pose."""

    pose: StartPose


@dataclass(frozen=True)
class StartTrial:
    """Ask the controller to start a trial."""


@dataclass(frozen=True)
class StopTrial:
    """Ask the controller to stop the trial."""


@dataclass(frozen=True)
class Say:
    """Log a sentence for people."""

    text: str
    warns: bool = False


Output = Record | Close | Abandon | Discard | Place | StartTrial | StopTrial | Say
Outputs = list[Output]
