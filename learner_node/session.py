"""
The learner's session: what is recorded, which trial comes next, and what is done when a peer dies.

It knows no ROS and no files: whoever owns a `Session` tells it what happens, with the time on a
steady clock, and carries out the effects it returns, in order.
"""

from typing import Final

from control_field.records import Outcome
from control_field.robot.stop_rules import StopReason
from episode_store.task_folder import EpisodeKind
from learner_node.effects import Abandon, Effects, Place, Record, Say, StartTrial, StopTrial
from learner_node.phases import (
    IN_TRIAL, LOST, MAX_ASKING, MAX_REQUESTS, patience, Peers, Phase, PLACE_REQUESTS, RECORDING,
    RETRY, SessionError, silence)
from learner_node.teaching import Teaching
from msgs_bridge.messages.memory_identity import difference
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.node.node_info import Operation

#: Who stops a trial, or leaves it unwatched, wants no other either.
_ENDS_SERIES: Final = (StopReason.ASKED.sentence, StopReason.NO_HEARTBEAT.sentence)


class Session(Teaching):
    """
    A session of teaching and trying.

    Parameters
    ----------
    settings : Settings
    next_start : callable
        Returns where the next trial starts.

    """

    def begin(self, now: float) -> None:
        """Take in that the bags that were found are being learnt from."""
        self._go(Phase.LEARNING, now)

    def relearn(self, now: float) -> Effects:
        """Take in that a bag is changed and all are learnt from anew; only when idle."""
        self._check_idle('change a bag', Operation.CHANGE)
        self.begin(now)
        return []

    def shut_down(self, now: float) -> Effects:
        """End what is under way, because the learner ends."""
        effects: Effects = [StopTrial()] if self.phase in IN_TRIAL else []
        if self.is_recording:
            effects += [Abandon(why := 'the learner was stopped', self.trial),
                        Say(f'{self.describe()}: broken off, {why}', warns=True)]
        self._go(Phase.IDLE, now)
        return effects

    # What people ask for

    def run_trials(self, n_trials: int, now: float) -> Effects:
        """Run trials one after the other; SessionError if that cannot be done now, or at all."""
        if not self.settings.simulation:
            raise SessionError('cannot set a real robot back (simulation is false): carry it to '
                               f'its start and call {self.settings.controller}/start_trial')
        self._check_idle('run trials', Operation.DRIVE)
        if self.revision < 0:
            raise SessionError(
                'nothing was learnt yet: show the way first, press s in teleop_node')
        return self.begin_trials(n_trials, now)

    def begin_trials(self, n_trials: int, now: float) -> Effects:
        """Run trials that nobody asked for (`auto_start`): they wait until they can begin."""
        self.n_left, self.is_stopped = n_trials, False
        self._go(Phase.WAITING, now)
        return self._proceed(now)

    def stop_trials(self, now: float) -> Effects:
        """Stop the trial and run no more; SessionError if none are being run."""
        if self.phase not in (*IN_TRIAL, Phase.WAITING, Phase.PLACING) and self.n_left == 0:
            raise SessionError('no trials are being run')
        self._end_series()
        if self.phase in (Phase.WAITING, Phase.PLACING):
            self._go(Phase.IDLE, now)
        return [StopTrial()] if self.phase in IN_TRIAL else []

    # What arrives

    def saw_peers(self, peers: Peers, now: float) -> Effects:
        """Take in who is there."""
        self._look_at_clock(now)
        lost = self._peers.lost(peers)
        if lost and now - self._woke < self.settings.peer_timeout:
            return []  # whoever sleeps for long is forgotten, and has to find the others anew
        self._peers = peers
        if not peers.controller:
            self._status = None
            self._decision_counter.clear()
        if lost and self.phase in (*IN_TRIAL, Phase.PLACING):
            return self._break_off(f'{lost} went away', now)
        return self._proceed(now)

    def heard_odometry(self, stamp: float, now: float) -> Effects:
        """Take in that an odometry has arrived."""
        self._absence.saw(stamp, now)
        self._stamp, self._moved = stamp, now
        if self.phase is not Phase.TRIAL:
            self._heard = now
        return self._finish(now) or self._cut_off(now)

    def heard_command(self, now: float) -> None:
        """Take in that a command has arrived; in a trial it shows that all are alive."""
        self._heard = now

    def saw_pose(self, x: float, y: float, yaw: float, now: float) -> Effects:
        """Take in where the robot is; of interest only where `wants_pose`."""
        if self.phase is Phase.DEMONSTRATION:
            self._attendance.saw_pose(x, y, yaw, now)
        if self.phase is Phase.PLACING and self._start.is_near(x, y, yaw):
            self._arrival.saw_robot(self._stamp, now)
        return self._start_placed(now)

    def saw_local_grid(self, stamp: float, now: float) -> Effects:
        """Take in that a neighbourhood has come: no trial starts on that of another place."""
        self._arrival.saw_local_grid(stamp)
        return self._start_placed(now)

    def _start_placed(self, now: float) -> Effects:
        if self.phase is not Phase.PLACING or not self._arrival.is_seen(now):
            return []
        self._decision_counter.clear()
        self._n_asked, self.trial, self._refusal = 0, 0, ''
        self._go(Phase.STARTING, now)
        return [Record(EpisodeKind.TRIAL), *self._ask(StartTrial(), now)]

    def saw_decisions(self, trial: int, n_rows: int, now: float) -> Effects:
        """Take in that decisions of a trial have arrived."""
        self._decision_counter.add(trial, n_rows)
        return self._finish(now) or self._take_up(now)

    def saw_status(self, status: TrialStatus, now: float) -> Effects:
        """Take in how the controller's trial stands."""
        self._look_at_clock(now)
        before, self._status = self._status, status
        if self.phase is Phase.DEMONSTRATION and self._intruder.saw(status, before):
            return self._intruded(now)
        if self._is_overtaken(status, now):
            return self._overtaken(status, now)
        if status.state in (State.RUNNING, State.PAUSED):
            return self._saw_running(status, before, now)
        if status.state is State.ENDED:
            return self._saw_ended(status, before, now)
        if self.phase is Phase.TRIAL:
            return self._break_off('the controller started anew', now)
        self._decision_counter.pass_over(0)
        # A controller that begins has not got what the one before it was asked.
        if self.phase is Phase.STARTING:
            self._n_silent, self._asked = LOST, now
        return self._proceed(now)

    def _is_overtaken(self, status: TrialStatus, now: float) -> bool:
        """Tell whether another trial has begun while this process slept."""
        return (self.phase is Phase.TRIAL and status.state is not State.IDLE
                and status.trial != self.trial and self._has_just_woken(now)
                and not difference(status.memory, self.memory))

    def _has_just_woken(self, now: float) -> bool:
        return now - self._woke <= 2.0 * self.settings.peer_timeout

    def _overtaken(self, status: TrialStatus, now: float) -> Effects:
        """Break a trial off whose end was slept through; who runs the one there is goes on."""
        self._status = None
        effects = self._break_off(
            f'the controller is at trial {status.trial} by now, and its end was not heard; trial '
            f'{status.trial} is not recorded either', now)
        self._status = status
        self._decision_counter.pass_over(status.trial)
        return effects

    def _saw_running(
        self, status: TrialStatus, before: TrialStatus | None, now: float,
    ) -> Effects:
        if self.phase is Phase.STARTING and (before is None or status.trial != before.trial):
            self.trial = status.trial
            self._go(Phase.TRIAL, now)
            if status.revision != self.revision:
                return self._break_off(
                    f'it runs on field revision {status.revision}, not {self.revision}', now)
        if self.phase is Phase.TRIAL and status.trial == self.trial and (
                external := difference(status.memory, self.memory)):
            return self._break_off(f'the controller {external}', now)
        return self._cut_off(now) or self._take_up(now)

    def _take_up(self, now: float) -> Effects:
        """Record the trial that somebody else has started, as long as nothing of it is lost."""
        if self.phase is not Phase.IDLE or not self._decision_counter.is_whole(self._status):
            return []
        assert self._status is not None
        if difference(self._status.memory, self.memory):
            return []  # another learner's; what lasts is said by the tick
        self.trial = self._status.trial
        self._go(Phase.TRIAL, now)
        return [Record(EpisodeKind.TRIAL)]

    def _saw_ended(
        self, status: TrialStatus, before: TrialStatus | None, now: float,
    ) -> Effects:
        if self.phase is Phase.STARTING and self._decision_counter[status.trial] > 0:
            self.trial = status.trial  # it ended before it was seen to run
        if self.phase not in IN_TRIAL or status.trial != self.trial:
            missed = self._decision_counter.missed(status, before, self.phase, self.memory)
            return [*([Say(missed, warns=True)] if missed else []), *self._proceed(now)]
        self._go(Phase.FINISHING, now)
        return self._finish(now)

    def _finish(self, now: float) -> Effects:
        """Close the trial's bag when all its decisions are there, and the drive up to its end."""
        status = self._status
        if self.phase is not Phase.FINISHING or status is None or status.outcome is None:
            return []
        if self._decision_counter[self.trial] < status.decisions or (
                (self._stamp < status.stamp or self._arrival.is_behind(status.stamp))
                and now - self._began < patience(self.settings.lockstep)):
            return []
        if status.outcome is not Outcome.ABORTED and (
                external := difference(status.memory, self.memory)):
            return self._break_off(f'the controller {external}', now)
        if status.outcome is Outcome.ABORTED:
            return self._break_off(status.reason or 'the controller aborted it', now, told=True)
        if status.reason.startswith(_ENDS_SERIES):
            self._end_series()
        self._decision_counter.forget(self.trial)
        return self._learn(now)

    def start_answered(self, accepted: bool, message: str, now: float) -> Effects:
        """Take in the controller's answer to a request to start."""
        if self.phase is not Phase.STARTING or accepted:
            return []
        self._n_silent, self._asked = LOST, now  # the next request comes after a while
        self._refusal = f'the controller does not start it: {message}'
        if self._n_asked < MAX_REQUESTS:
            return []
        return self._break_off(self._refusal, now)

    def learnt(self, revision: int, now: float, memory: str = '') -> Effects:
        """Take in that the closed bag was learnt from, or could not be (revision as before)."""
        self.revision, self.memory = revision, memory
        if self.phase is not Phase.LEARNING:
            return []
        self.n_left = max(self.n_left - 1, 0) if self.trial else self.n_left
        self.trial = 0
        self._go(Phase.WAITING if self.n_left else Phase.IDLE, now)
        return self._take_up(now) or self._proceed(now)

    def failed(self, why: str, now: float) -> Effects:
        """Take in that nothing more can be recorded: stop the robot, whoever drives it."""
        self._lost = why
        stops = self.phase in RECORDING
        self.n_left = 0
        self._decision_counter.pass_over(self.trial)
        self._go(Phase.IDLE, now)
        return [Abandon(''), *([StopTrial()] if stops else [])]

    # Time alone

    def tick(self, now: float) -> Effects:
        """Look whether something has not come for too long; call it about every 50 ms."""
        self._look_at_clock(now)
        if self.phase is Phase.IDLE:
            lost = self._decision_counter.loss(self._status, self.memory)
            return [Say(lost, warns=True)] if lost else []
        if self.phase is Phase.SETTLING:
            return self._settle(now)
        if self.phase is Phase.DEMONSTRATION:
            lasts = self._intruder.lasts(self._status)
            return self._intruded(now) if lasts else self._watch_drive(now)
        if self.phase is Phase.PLACING and self._arrival.is_there:
            return self._start_placed(now)
        if self.phase is Phase.TRIAL:
            return self._watch_trial(now)
        if self.phase is Phase.FINISHING and now - self._began > self.settings.peer_timeout:
            return self._break_off(self._why_short(now), now)
        if self.phase is Phase.FINISHING:
            return self._finish(now)
        self._n_silent += 1
        waits = self.phase is Phase.STARTING and self._n_silent < LOST
        return self._ask_again(now) if now - self._asked > RETRY and not waits else []

    def _why_short(self, now: float) -> str:
        """Say that a trial has ended of which something is missing."""
        n_decided = self._status.decisions if self._status else 0
        said = f'{self._decision_counter[self.trial]} of {n_decided} decisions arrived'
        if not self._has_just_woken(now):
            return said
        return f'{said}; the learner itself had stood still for {self._slept:.1f} s'

    def _watch_trial(self, now: float) -> Effects:
        if self._status is None or self._status.state is not State.RUNNING:
            return []
        heard = max(self._heard, self._began)
        silent = silence(now, heard, self._moved, self.settings.peer_timeout)
        return self._break_off(silent, now) if silent else []

    def _ask_again(self, now: float) -> Effects:
        if self.phase is Phase.WAITING:
            return self._proceed(now)
        if self.phase not in (Phase.PLACING, Phase.STARTING):
            return []
        placing = self.phase is Phase.PLACING
        if self._n_asked >= MAX_REQUESTS or now - self._began > MAX_ASKING:
            return self._break_off('the robot was not set back' if placing else
                                   self._refusal or 'the controller does not answer', now)
        if placing and self._n_asked % PLACE_REQUESTS == 0:
            self._start = self._next_start()
        return self._ask(Place(self._start) if placing else StartTrial(), now)
