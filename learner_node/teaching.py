"""The part of a session in which a person shows the way: a demonstration from start to end."""

from typing import Final

from episode_store.task_folder import EpisodeKind
from learner_node.decision_counter import INTRUDED, is_running
from learner_node.effects import Abandon, Discard, Effects, Record, Say, StopTrial
from learner_node.phases import patience, Phase, QUIET, SessionError
from learner_node.transitions import Transitions
from msgs_bridge.node.node_info import Operation

#: Why a demonstration was not kept whose teacher has left; and what `n` is told then.
LEFT: Final = 'nobody was at the keys any more'
_LEFT_ANSWER: Final = (f'{LEFT}, so the recording ended; press y in teleop_node to keep it '
                       f'all the same, d to take it away, s to begin a new one')


class Teaching(Transitions):
    """Demonstrations: begun, kept, thrown away, broken off by a trial or for want of a teacher."""

    def record(self, now: float) -> Effects:
        """Begin a demonstration; SessionError if something else is under way, or no odometry."""
        self._check_idle('record a demonstration', Operation.TEACH)
        if missing := self._absence.of_odometry(now, self.settings):
            raise SessionError(f'cannot record a demonstration: {missing}')
        self._intruder.begin(self._status, self._stamp, self.settings.controller)
        self._attendance.begin(now)
        self._absence.begin()
        self._lost, self.is_stopped = '', False
        self._go(Phase.DEMONSTRATION, now)
        return [Record(EpisodeKind.DEMO)]

    def saw_sound(self) -> None:
        """Take in that something can be learnt from an odometry that was looked at."""
        self._absence.saw_sound()

    def saw_unsound(self, why: str, now: float) -> None:
        """Take in why nothing can be learnt from an odometry that was looked at."""
        self._absence.saw_unsound(why, now)

    def keep(self, now: float) -> Effects:
        """End the demonstration and learn from it; SessionError if none is recorded."""
        self._check_recording()
        self._go(Phase.SETTLING, now)
        return []

    def discard(self, now: float) -> Effects:
        """Throw the demonstration that is being recorded away; like `keep` otherwise."""
        self._check_recording()
        self._go(Phase.IDLE, now)
        return [Discard()]

    def _check_recording(self) -> None:
        if self.phase is not Phase.DEMONSTRATION:
            lost = f': {self._lost}' if self._lost else '; press s in teleop_node to start one'
            raise SessionError(f'no demonstration is being recorded{lost}')

    def _settle(self, now: float) -> Effects:
        waited = now - self._began
        is_quiet = min(now - self._heard, waited) >= QUIET
        if waited < patience(self.settings.lockstep) and (
                not is_quiet or self._arrival.is_behind(self._stamp)):
            return []
        return self._learn(now)

    def _cut_off(self, now: float) -> Effects:
        """Close the demonstration that is being kept before the drive of a trial that begins."""
        begins = is_running(self._status) and self._status.stamp <= self._stamp
        return self._learn(now) if begins and self.phase is Phase.SETTLING else []

    def _intruded(self, now: float) -> Effects:
        """Break the demonstration off: what a trial drives is not what a person shows."""
        assert self._status is not None
        self._lost = INTRUDED.format(self._status.trial)
        self._decision_counter.pass_over(self._status.trial)
        self._go(Phase.IDLE, now)
        return [*([StopTrial()] if is_running(self._status) else []), Abandon(self._lost),
                Say(f'the demonstration is broken off and not kept: {self._lost}', warns=True)]

    def heard_teacher(self, now: float) -> None:
        """Take in that somebody is at the keys."""
        self._attendance.saw_heartbeat(now)

    def wants_pose(self, now: float) -> bool:
        """Tell whether `saw_pose` is to be told where the robot is."""
        return self.phase is Phase.PLACING or (
            self.phase is Phase.DEMONSTRATION and self._attendance.asks_for_poses(now))

    def _watch_drive(self, now: float) -> Effects:
        """Say why a drive cannot be learnt: who shows it must not find out at its end."""
        if self._attendance.has_left(now, self.settings.teacher_timeout):
            return self._left_alone(now)
        if now - self._woke < self.settings.peer_timeout:
            return []  # what this process slept through was nobody's silence
        news = self._absence.news(now, self.settings)
        return [Say(f'nothing can be learnt from what is driven now: {news}', warns=True)] if (
            news) else []

    def _left_alone(self, now: float) -> Effects:
        """End the demonstration of a teacher who is gone; it can be kept later all the same."""
        self._lost = _LEFT_ANSWER
        self._go(Phase.IDLE, now)
        return [Abandon(LEFT), Say(
            f'The recording of the drive has ended, because {LEFT}. The drive is there, but not '
            f'learnt: press y in teleop_node to keep it all the same, d to take it away',
            warns=True)]
