"""
The learner's session: what is recorded, which trial comes next, and what is done when a peer dies.

It knows no ROS and no files: whoever owns a `Session` tells it what happens, with the time on a
steady clock, and carries out the outputs it returns, in order. `phases.TRANSITIONS` is its map.
"""

from collections.abc import Callable

from control_field.poses import StartPose
from learner_node.session.demonstration import Demonstration
from learner_node.session.inputs import is_running, Peers
from learner_node.session.outputs import Abandon, Outputs, Say, StopTrial
from learner_node.session.phases import IN_TRIAL, Phase, SessionError
from learner_node.session.series import Series
from learner_node.session.state import SessionState
from learner_node.session.trial_recording import TrialRecording
from learner_node.settings import Settings
from msgs_bridge.messages.trial_status import TrialStatus
from msgs_bridge.node.node_info import Operation


class Session:
    """
    A session of teaching and trying: takes what happens to the part whose phase it is.

    Parameters
    ----------
    settings : Settings
    next_start : callable
        Returns where the next trial starts.

    """

    def __init__(self, settings: Settings, next_start: Callable[[], StartPose]) -> None:
        """Start idle, without a field."""
        self.state = SessionState(settings)
        self.series = Series(self.state, next_start)
        self.trials = TrialRecording(self.state, self.series)
        self.demonstration = Demonstration(self.state, self.series)

    def begin(self, now: float) -> None:
        """Wait for the bags that were found to be learnt from."""
        self.state.go(Phase.LEARNING, now)

    def relearn(self, now: float) -> Outputs:
        """Wait for all bags to be learnt from anew, because one is changed; only when idle."""
        self.state.check_idle('change a bag', Operation.CHANGE)
        self.begin(now)
        return []

    def check_between(self, what: str, operation: Operation) -> None:
        """
        Check that nothing is under way, be it somebody else's trial.

        Raises
        ------
        SessionError
            If something is, or it must not be done now.

        """
        self.state.check_idle(what, operation)
        status = self.state.inputs.status
        if is_running(status):
            raise SessionError(f'cannot {what} now: trial {status.trial} is still {status.state}',
                               'trying')

    def on_other_task(self) -> None:
        """Record nothing of a trial that somebody runs on the field of the task before."""
        status = self.state.inputs.status
        if is_running(status):
            self.trials.unrecorded.pass_over(status.trial)

    def shut_down(self, now: float) -> Outputs:
        """End what is under way, because the learner ends."""
        state = self.state
        outputs: Outputs = [StopTrial()] if state.phase in IN_TRIAL else []
        if state.is_recording:
            outputs += [Abandon(why := 'the learner was stopped', state.trial),
                        Say(f'{state.describe()}: broken off, {why}', warns=True)]
        state.go(Phase.IDLE, now)
        return outputs

    def wants_pose(self, now: float) -> bool:
        """Return True if `on_pose` is to be told where the robot is."""
        return self.state.phase is Phase.PLACING or self.demonstration.wants_pose(now)

    # What arrives

    def on_peers(self, peers: Peers, now: float) -> Outputs:
        """Go on with who is there."""
        self._look_at_clock(now)
        state, inputs = self.state, self.state.inputs
        lost = inputs.peers.lost(peers)
        if lost and inputs.suspension.age(now) < state.settings.peer_timeout:
            return []  # whoever sleeps for long is forgotten, and has to find the others anew
        inputs.peers = peers
        if not peers.controller:
            inputs.status = None
            self.trials.forget()
        if lost and state.phase in (*IN_TRIAL, Phase.PLACING):
            return self.trials.break_off(f'{lost} went away', now)
        return self.series.proceed(now)

    def on_odometry(self, stamp: float, now: float) -> Outputs:
        """Go on with an odometry of a stamp."""
        inputs = self.state.inputs
        self.demonstration.odometry.on_odometry(stamp, now)
        inputs.odometry_stamp, inputs.last_odometry = stamp, now
        if self.state.phase is not Phase.TRIAL:
            inputs.last_sign_of_life = now
        return self.trials.finish(now) or self.demonstration.cut_off(now)

    def on_command(self, now: float) -> None:
        """Note a command on `cmd_vel`; it shows that all are alive, or somebody teaches."""
        self.state.inputs.last_sign_of_life = now
        self.demonstration.teacher.on_command(now)

    def on_pose(self, x: float, y: float, yaw: float, now: float) -> Outputs:
        """Go on with where the robot is; of interest only where `wants_pose`."""
        if self.state.phase is Phase.DEMONSTRATION:
            self.demonstration.teacher.on_pose(x, y, yaw, now)
        self.series.on_pose(x, y, yaw, now)
        return self._start_trial(now)

    def on_local_grid(self, stamp: float, now: float) -> Outputs:
        """Go on with a local grid of a stamp: no trial starts on that of another place."""
        self.state.inputs.local_grid_stamp = stamp
        return self._start_trial(now)

    def _start_trial(self, now: float) -> Outputs:
        return self.trials.start(now) if self.series.can_start(now) else []

    def on_status(self, status: TrialStatus, now: float) -> Outputs:
        """Go on with how the controller's trial stands."""
        self._look_at_clock(now)
        inputs = self.state.inputs
        before, inputs.status = inputs.status, status
        self.state.unheard_stop.reset()
        inputs.slept = 0.0
        if self.state.phase is Phase.DEMONSTRATION:
            self.demonstration.intruder.on_status(status, before)
            if self.demonstration.intruder.is_there:
                return self._break_off_demonstration(now)
        return self.trials.on_status(status, before, now) or self.demonstration.cut_off(now)

    def on_start_response(self, accepted: bool, message: str, now: float) -> Outputs:
        """Go on with the controller's answer to a request to start."""
        if self.state.phase is not Phase.STARTING or accepted:
            return []
        request = self.series.request
        request.on_lost(now)  # the next one comes after a while
        request.refusal = f'the controller does not start it: {message}'
        return self.trials.break_off(request.refusal, now) if request.is_vain else []

    def on_learnt(self, revision: int, now: float, memory: str = '') -> Outputs:
        """Go on with what the closed bag taught (or could not: the revision is as before)."""
        state, series = self.state, self.series
        state.revision, state.memory = revision, memory
        self.demonstration.ended_code = ''
        if state.phase is not Phase.LEARNING:
            return []
        series.n_left = max(series.n_left - 1, 0) if state.trial else series.n_left
        state.trial = 0
        series.go_on(now)
        return self.trials.take_up(now) or series.proceed(now)

    def on_recording_failed(self, why: str, now: float) -> Outputs:
        """Stop the robot, whoever drives it: nothing more can be recorded."""
        self.demonstration.ended_because, self.demonstration.ended_code = why, 'disk'
        stops = self.state.is_recording
        self.series.n_left = 0
        self.trials.unrecorded.pass_over(self.state.trial)
        self.state.go(Phase.IDLE, now)
        return [*([StopTrial()] if stops else []), Abandon('')]

    # Time alone

    def tick(self, now: float) -> Outputs:
        """Look whether something has not come for too long; call it about every 50 ms."""
        self._look_at_clock(now)
        match self.state.phase:
            case Phase.DEMONSTRATION:
                return self._watch_demonstration(now)
            case Phase.SETTLING:
                return self.demonstration.settle(now)
            case Phase.WAITING | Phase.PLACING | Phase.STARTING:
                return self._watch_series(now)
            case Phase.IDLE | Phase.TRIAL | Phase.FINISHING:
                return self.trials.tick(now)
        return []

    def _watch_demonstration(self, now: float) -> Outputs:
        self.demonstration.intruder.tick(self.state.inputs.status)
        if self.demonstration.intruder.is_there:
            return self._break_off_demonstration(now)
        return self.demonstration.watch(now)

    def _break_off_demonstration(self, now: float) -> Outputs:
        status = self.state.inputs.status
        assert status is not None
        self.trials.unrecorded.pass_over(status.trial)
        return self.demonstration.break_off(status, now)

    def _watch_series(self, now: float) -> Outputs:
        if self.series.is_placed:
            return self._start_trial(now)
        self.series.request.tick()
        if not self.series.is_request_due(now):
            return []
        if why := self.series.failure(now):
            return self.trials.break_off(why, now)
        return self.series.ask_again(now)

    def _look_at_clock(self, now: float) -> None:
        """Note the time; what this process itself slept through was nobody's silence."""
        if slept := self.state.inputs.suspension.look(now):
            self.state.on_suspended(slept, now)
            self.series.request.on_suspended(slept, now)
            self.demonstration.teacher.on_suspended(slept, now)
