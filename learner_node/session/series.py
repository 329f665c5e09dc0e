"""The part of a session that runs trials one after the other: who is waited for, what is asked."""

from collections.abc import Callable
import math
from typing import Final

from control_field.poses import StartPose
from learner_node.session.inputs import is_running
from learner_node.session.outputs import Output, Outputs, Place, Say, StartTrial, StopTrial
from learner_node.session.phases import IN_TRIAL, Phase, SessionError
from learner_node.session.state import SessionState
from msgs_bridge.node.node_info import Operation

#: Time after which a request that was not answered is made again, [s].
RETRY: Final = 0.3
#: Ticks after which a request to start a trial that nobody has answered was lost. Made again any
#: sooner it may start two trials; and ticks, not seconds, because each of them comes after a look
#: at what has arrived, however long this process was held up.
LOST: Final = 60
#: How often the same request is made before the run is given up, and for how long, [s].
MAX_REQUESTS: Final = 30
_MAX_ASKING: Final = 10.0
#: After how many the robot is sent to another start: that one may lie in an obstacle.
_PLACE_REQUESTS: Final = 4
#: Time after which trials are given up because the end of another is not heard; in `peer_timeout`.
_MAX_UNHEARD: Final = 6.0
#: Longest wait for the local grid of where the robot was set, [s].
LOCAL_GRID_PATIENCE: Final = 1.0


class RepeatedRequest:
    """When a request was made, how often, and whether it is time to make it again."""

    def __init__(self) -> None:
        """Start with none made."""
        self.refusal = ''  #: what was answered the last time
        self._n_made = self._n_ticks = 0
        self._made_at = -math.inf

    def begin(self) -> None:
        """Begin to ask for something else."""
        self._n_made, self.refusal = 0, ''

    def on_made(self, now: float) -> None:
        """Count a request."""
        self._made_at, self._n_ticks = now, 0
        self._n_made += 1

    def on_lost(self, now: float) -> None:
        """Note that no answer will come; the next one is due after a while."""
        self._n_ticks = LOST
        self.postpone(now)

    def on_suspended(self, seconds: float, now: float) -> None:
        """Count the time during which this process was suspended out."""
        self._made_at = min(self._made_at + seconds, now)

    def postpone(self, now: float) -> None:
        """Let the next one wait as if one had been made now."""
        self._made_at = now

    def tick(self) -> None:
        """Count how long an answer has not come."""
        self._n_ticks += 1

    @property
    def is_lost(self) -> bool:
        """Whether an answer would have come by now."""
        return self._n_ticks >= LOST

    @property
    def is_vain(self) -> bool:
        """Whether it was made too often."""
        return self._n_made >= MAX_REQUESTS

    @property
    def needs_another_start(self) -> bool:
        """Whether it was made so often that the start may be the reason."""
        return self._n_made % _PLACE_REQUESTS == 0

    def is_due(self, now: float) -> bool:
        """Return True if it is time to make it again."""
        return now - self._made_at > RETRY


class Arrival:
    """The robot's arrival at the place where it was set."""

    def __init__(self) -> None:
        """Start before it."""
        self._stamp: float | None = None
        self._at = 0.0

    @property
    def has_come(self) -> bool:
        """Whether the robot is there."""
        return self._stamp is not None

    def reset(self) -> None:
        """Wait for the next one."""
        self._stamp = None

    def on_robot(self, stamp: float, now: float) -> None:
        """Note that odometry of a stamp shows the robot there."""
        if self._stamp is None:
            self._stamp, self._at = stamp, now

    def is_seen(self, local_grid_stamp: float | None, now: float) -> bool:
        """
        Return True once the robot is there and a newer local grid has arrived.

        After `LOCAL_GRID_PATIENCE`, or where there are no local grids, the robot is enough.
        """
        return self._stamp is not None and (
            local_grid_stamp is None or local_grid_stamp >= self._stamp
            or now - self._at > LOCAL_GRID_PATIENCE)


class Series:
    """
    Trials that are run one after the other, each from a start that the robot is set to.

    Parameters
    ----------
    state : SessionState
    next_start : callable
        Returns where the next trial starts.

    """

    def __init__(self, state: SessionState, next_start: Callable[[], StartPose]) -> None:
        """Start with none to run."""
        self.n_left = 0
        #: Whether a person has stopped the trials: none begins by itself then.
        self.is_stopped = False
        self.request = RepeatedRequest()
        self._state = state
        self._next_start = next_start
        self._start = StartPose(0.0, 0.0)
        self._arrival = Arrival()
        self._reported = ''  #: what people were told that is waited for

    def run(self, n_trials: int, now: float) -> Outputs:
        """Run trials one after the other; SessionError if that cannot be done now, or at all."""
        settings = self._state.settings
        if not settings.simulation:
            raise SessionError(
                'cannot set a real robot back (simulation is false): carry it to its start and '
                f'call {settings.controller}/start_trial', 'real_robot')
        self._state.check_idle('run trials', Operation.DRIVE)
        if self._state.revision < 0:
            raise SessionError(
                'nothing was learnt yet: show the way first, press s in teleop_node',
                'nothing_learnt')
        return self.begin(n_trials, now)

    def begin(self, n_trials: int, now: float) -> Outputs:
        """Run trials that nobody asked for (`auto_start`): they wait until they can begin."""
        self.n_left, self.is_stopped = n_trials, False
        self._state.go(Phase.WAITING, now)
        return self.proceed(now)

    def stop(self, now: float) -> Outputs:
        """Stop the trial and run no more; SessionError if none are being run."""
        phase = self._state.phase
        is_between = phase in (Phase.WAITING, Phase.PLACING)
        if not is_between and phase not in IN_TRIAL and self.n_left == 0:
            raise SessionError('no trials are being run', 'no_trials')
        self.end()
        if is_between:
            self._state.go(Phase.IDLE, now)
        return [StopTrial()] if phase in IN_TRIAL else []

    def end(self) -> None:
        """Run no more trials after the present one, because a person wants none."""
        self.n_left, self.is_stopped = 0, True

    def go_on(self, now: float) -> None:
        """Wait for the next trial, if there is one to run."""
        self._state.go(Phase.WAITING if self.n_left else Phase.IDLE, now)

    def proceed(self, now: float) -> Outputs:
        """Set the robot back for the next trial when everything is there for it."""
        if self._state.phase is not Phase.WAITING:
            return []
        if obstacle := self._state.obstacle():
            return self._wait(obstacle, now)
        self._start = self._next_start()
        self._reported = ''
        self.request.begin()
        self._arrival.reset()
        self._state.go(Phase.PLACING, now)
        return self._ask(Place(self._start), now)

    def _wait(self, obstacle: str, now: float) -> Outputs:
        outputs = self._stop_running(now)
        obstacle = self._state.unheard_stop.problem or obstacle
        waited = now - self._state.since
        if obstacle != self._reported and waited > self._state.settings.peer_timeout:
            self._reported = obstacle
            outputs.append(Say(f'the next trial waits: {obstacle}', warns=True))
        return outputs

    def _stop_running(self, now: float) -> Outputs:
        """Ask to stop a trial that runs, as far as was heard, but not for ever."""
        status, stop = self._state.inputs.status, self._state.unheard_stop
        if not is_running(status):
            stop.reset()
            return []
        settings = self._state.settings
        if stop.has_lasted(_MAX_UNHEARD * settings.peer_timeout, now):
            return self._give_up(stop.problem, now)
        if stop.has_lasted(settings.peer_timeout, now) and not stop.problem:
            stop.explain(status.trial, settings.controller, settings.peer_timeout)
        if not self.request.is_due(now):
            return []
        stop.on_made(now)
        return self._ask(StopTrial(), now)

    def _give_up(self, problem: str, now: float) -> Outputs:
        """Run no more trials, because the controller is not heard."""
        self.n_left, self._reported = 0, problem
        self._state.unheard_stop.reset()
        self._state.go(Phase.IDLE, now)
        return [Say(f'no more trials are run: {problem}', warns=True)]

    def _ask(self, request: Output, now: float) -> Outputs:
        self.request.on_made(now)
        return [request]

    def on_pose(self, x: float, y: float, yaw: float, now: float) -> None:
        """Note whether the robot is at its start."""
        if self._state.phase is Phase.PLACING and self._start.is_near(x, y, yaw):
            self._arrival.on_robot(self._state.inputs.odometry_stamp, now)

    @property
    def is_placed(self) -> bool:
        """Whether the robot was seen at its start, and the trial is yet to begin."""
        return self._state.phase is Phase.PLACING and self._arrival.has_come

    def can_start(self, now: float) -> bool:
        """Return True once the robot and its local grid are those of the start."""
        return self._state.phase is Phase.PLACING and self._arrival.is_seen(
            self._state.inputs.local_grid_stamp, now)

    def start(self, now: float) -> Outputs:
        """Ask the controller to start the trial."""
        self.request.begin()
        self._state.go(Phase.STARTING, now)
        return self._ask(StartTrial(), now)

    def is_request_due(self, now: float) -> bool:
        """Return True if what was asked for is to be asked for again."""
        waits = self._state.phase is Phase.STARTING and not self.request.is_lost
        return self.request.is_due(now) and not waits

    def failure(self, now: float) -> str:
        """Say why the robot is not set back, or the trial not started, after many requests."""
        state = self._state
        is_over = self.request.is_vain or now - state.since > _MAX_ASKING
        if not is_over or state.phase not in (Phase.PLACING, Phase.STARTING):
            return ''
        if state.phase is Phase.PLACING:
            return 'the robot was not set back'
        return self.request.refusal or 'the controller does not answer'

    def ask_again(self, now: float) -> Outputs:
        """Make the request of this phase again."""
        if self._state.phase is Phase.STARTING:
            return self._ask(StartTrial(), now)
        if self._state.phase is not Phase.PLACING:
            return self.proceed(now)
        if self.request.needs_another_start:
            self._start = self._next_start()
        return self._ask(Place(self._start), now)
