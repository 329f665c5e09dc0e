"""The phases of a session, and how long it waits in them."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from msgs_bridge.messages.memory_identity import difference
from msgs_bridge.messages.trial_status import State, TrialStatus

#: A recording ends when nothing has come for so long, [s]: what is under way still belongs to it.
QUIET: Final = 0.1
#: Longest wait for that quiet, [s]: a real robot is never quiet.
MAX_SETTLING: Final = 0.3
#: Time after which a request that was not answered is made again, [s].
RETRY: Final = 0.3
#: Ticks after which a request to start a trial that nobody has answered was lost. Made again any
#: sooner it may start two trials; and ticks, not seconds, because each of them comes after a look
#: at what has arrived, however long this process was held up.
LOST: Final = 60
#: How often the same request is made before the run is given up, and for how long, [s].
MAX_REQUESTS: Final = 30
MAX_ASKING: Final = 10.0
#: After how many the robot is sent to another start: that one may lie in an obstacle.
PLACE_REQUESTS: Final = 4

#: Time between two looks at the clock from which on this process itself was held up, [s].
ASLEEP: Final = 1.0
#: Longest wait for the local grid of where the robot was set, [s].
LOCAL_GRID_PATIENCE: Final = 1.0


class SessionError(ValueError):
    """What was asked for cannot be done now; the message says why and what to do."""


class Phase(StrEnum):
    """What the session is doing."""

    IDLE = 'idle'
    DEMONSTRATION = 'demonstration'  #: a person drives, and it is recorded
    SETTLING = 'settling'            #: the person is done, the last messages come in
    WAITING = 'waiting'              #: for peers, or for the controller to have the field
    PLACING = 'placing'              #: for odometry to show the robot at the start
    STARTING = 'starting'            #: for the controller to say that the trial runs
    TRIAL = 'trial'
    FINISHING = 'finishing'          #: the trial has ended, its last decisions come in
    LEARNING = 'learning'


#: Phases with a trial's bag open.
IN_TRIAL: Final = (Phase.STARTING, Phase.TRIAL, Phase.FINISHING)
#: Phases with a bag open.
RECORDING: Final = (Phase.DEMONSTRATION, Phase.SETTLING, *IN_TRIAL)

#: What is under way, in a few words.
WORDS: Final = {
    Phase.IDLE: 'nothing is under way', Phase.DEMONSTRATION: 'a demonstration is recorded',
    Phase.SETTLING: 'a demonstration is being kept', Phase.LEARNING: 'learning',
    Phase.PLACING: 'the robot is being set back', Phase.STARTING: 'a trial is being started'}


def remedy(phase: Phase) -> str:
    """Say how a person ends what is under way, as the end of a sentence; empty where it ends."""
    if phase is Phase.DEMONSTRATION:
        return '; press n in teleop_node to keep it, a to throw it away'
    running = phase in (Phase.WAITING, Phase.PLACING, Phase.STARTING, Phase.TRIAL)
    return '; press space in teleop_node to end that' if running else ''


@dataclass(frozen=True)
class Peers:
    """Who is there: the controller, and a robot that publishes odometry."""

    controller: bool = False
    robot: bool = False

    def lost(self, later: 'Peers') -> str:
        """Say who is no longer there later; empty if nobody has gone."""
        return ' and '.join(
            name for name, was, there in (('the controller', self.controller, later.controller),
                                          ('the robot', self.robot, later.robot))
            if was and not there)


def silence(now: float, heard: float, moved: float, timeout: float) -> str:
    """
    Say what has not come for too long while a trial runs; empty if nothing has.

    Parameters
    ----------
    now, heard, moved : float, [s]
        The time, and those of the last sign of life and the last odometry.
    timeout : float, [s]

    """
    if now - heard <= timeout:
        return ''
    what = 'odometry' if now - moved > timeout else 'command of the controller'
    return f'no {what} for {now - heard:.1f} s'


def patience(lockstep: bool) -> float:
    """Return how long the last messages may take, [s]; a lock-step runs ahead of its recorder."""
    return 10 * MAX_SETTLING if lockstep else MAX_SETTLING


class Arrival:
    """Whether a robot that is set back has arrived, and its local grid, which may be slower."""

    def __init__(self) -> None:
        """Start away, without any local grid."""
        self._seen: float | None = None
        self._stamp: float | None = None
        self._at = 0.0

    @property
    def is_there(self) -> bool:
        """Tell whether the robot has arrived."""
        return self._stamp is not None

    def leave(self) -> None:
        """Take in that the robot is to be set back."""
        self._stamp = None

    def saw_robot(self, stamp: float, now: float) -> None:
        """Take in that odometry of a stamp shows the robot where it was to be set."""
        if self._stamp is None:
            self._stamp, self._at = stamp, now

    def saw_local_grid(self, stamp: float) -> None:
        """Take in that a neighbourhood of a stamp has come."""
        self._seen = stamp

    def is_behind(self, stamp: float) -> bool:
        """Tell whether the local grid of a stamp may yet come: that of before has."""
        return self._seen is not None and self._seen < stamp

    def is_seen(self, now: float) -> bool:
        """
        Return True once the robot is at its start and a newer local grid has arrived.

        After `LOCAL_GRID_PATIENCE` the robot alone is enough.
        """
        return self._stamp is not None and (
            self._seen is None or self._seen >= self._stamp
            or now - self._at > LOCAL_GRID_PATIENCE)


def obstacle(
    peers: Peers, status: TrialStatus | None, revision: int, controller: str, memory: str = '',
) -> str:
    """
    Return what keeps the next trial from being started; empty if nothing does.

    Parameters
    ----------
    peers : Peers
    status : TrialStatus or None
        Newest word of the controller.
    revision : int
        Of the field that was pushed.
    controller : str
        Its name.
    memory : str
        Whose field was pushed.

    """
    if not peers.controller or status is None:
        return f'{controller} is not there'
    if not peers.robot:
        return 'no robot publishes odometry'
    if status.state in (State.RUNNING, State.PAUSED):
        return f'trial {status.trial} is still running'
    problem = difference(status.memory, memory)
    if status.revision != revision and not (problem and status.memory):
        return f'the controller has field revision {status.revision}, not {revision}'
    return f'the controller {problem}' if problem else ''
