"""The part of a session in which a person shows the way: a demonstration from start to end."""

from typing import Final

from episode_store.task_folder import EpisodeKind
from learner_node.session.inputs import is_running
from learner_node.session.intruder import Intruder
from learner_node.session.odometry_monitor import OdometryMonitor
from learner_node.session.outputs import Abandon, Close, Discard, Outputs, Record, Say, StopTrial
from learner_node.session.phases import Phase, SessionError
from learner_node.session.series import Series
from learner_node.session.state import SessionState
from learner_node.session.teacher_monitor import TeacherMonitor
from msgs_bridge.messages.trial_status import TrialStatus
from msgs_bridge.node.node_info import Operation
from msgs_bridge.node.throttled_log import template_of

#: A recording ends when nothing has come for so long, [s]: what is under way still belongs to it.
_QUIET: Final = 0.1
#: Why a demonstration is not kept during which a trial ran, by the trial's number.
_INTRUDED: Final = 'trial {} ran meanwhile and drove the robot; show the way again'
#: Why a demonstration was not kept whose teacher has left; and what `n` is told then.
LEFT: Final = 'nobody was at the keys any more'
_LEFT_ANSWER: Final = (f'{LEFT}, so the recording ended; press y in teleop_node to keep it '
                       f'all the same, d to take it away, s to begin a new one')


class Demonstration:
    """
    Demonstrations: begun, kept, thrown away, broken off by a trial or for want of a teacher.

    Parameters
    ----------
    state : SessionState
    series : Series
        Trials that a person has stopped may begin by themselves again after a demonstration.

    """

    def __init__(self, state: SessionState, series: Series) -> None:
        """Start with none."""
        self.odometry = OdometryMonitor(state.inputs.suspension)
        self.teacher = TeacherMonitor()
        self.intruder = Intruder()
        self.ended_because = ''  #: why it ended without being kept
        #: The same as a code, until something is learnt or another begins.
        self.ended_code = ''
        self._state, self._series = state, series
        self._reported: set[str] = set()

    def record(self, now: float) -> Outputs:
        """Begin a demonstration; SessionError if something else is under way, or no odometry."""
        state = self._state
        state.check_idle('record a demonstration', Operation.TEACH)
        if problem := self.odometry.problem(now, state.settings):
            raise SessionError(f'cannot record a demonstration: {problem}', 'no_robot')
        inputs = state.inputs
        self.intruder.begin(inputs.status, inputs.odometry_stamp, state.settings.controller)
        self.teacher.begin(now)
        self.ended_because, self.ended_code, self._series.is_stopped = '', '', False
        self._reported.clear()
        state.go(Phase.DEMONSTRATION, now)
        return [Record(EpisodeKind.DEMO)]

    def keep(self, now: float) -> Outputs:
        """End the demonstration and learn from it; SessionError if none is recorded."""
        self._check_recording()
        self._state.go(Phase.SETTLING, now)
        return []

    def discard(self, now: float) -> Outputs:
        """Throw the demonstration that is being recorded away; like `keep` otherwise."""
        self._check_recording()
        self._state.go(Phase.IDLE, now)
        return [Discard()]

    def _check_recording(self) -> None:
        if self._state.phase is not Phase.DEMONSTRATION:
            why = self.ended_because
            lost = f': {why}' if why else '; press s in teleop_node to start one'
            raise SessionError(f'no demonstration is being recorded{lost}',
                               self.ended_code or 'not_recording')

    def wants_pose(self, now: float) -> bool:
        """Return True if it matters whether the robot moves."""
        return self._state.phase is Phase.DEMONSTRATION and self.teacher.asks_for_poses(now)

    def settle(self, now: float) -> Outputs:
        """Close the bag once no more comes, or the last messages have had their time."""
        state, inputs = self._state, self._state.inputs
        is_quiet = now - max(inputs.last_sign_of_life, state.since) >= _QUIET
        is_complete = is_quiet and not inputs.awaits_local_grid(inputs.odometry_stamp)
        may_wait = state.may_settle(now) and not is_complete
        return [] if may_wait or state.is_catching_up(now) else self._learn(now)

    def cut_off(self, now: float) -> Outputs:
        """Close the demonstration that is being kept before the drive of a trial that begins."""
        inputs = self._state.inputs
        begins = is_running(inputs.status) and inputs.status.stamp <= inputs.odometry_stamp
        return self._learn(now) if begins and self._state.phase is Phase.SETTLING else []

    def _learn(self, now: float) -> Outputs:
        self._state.go(Phase.LEARNING, now)
        return [Close()]

    def break_off(self, status: TrialStatus, now: float) -> Outputs:
        """Break the demonstration off: what a trial drives is not what a person shows."""
        self.ended_because, self.ended_code = _INTRUDED.format(status.trial), 'intruded'
        self._state.go(Phase.IDLE, now)
        return [*([StopTrial()] if is_running(status) else []), Abandon(self.ended_because),
                Say(f'the demonstration is broken off and not kept: {self.ended_because}',
                    warns=True)]

    def watch(self, now: float) -> Outputs:
        """Say why a drive cannot be learnt: who shows it must not find out at its end."""
        settings = self._state.settings
        if self.teacher.has_left(now, settings.teacher_timeout):
            return self._leave_alone(now)
        if self._state.inputs.suspension.age(now) < settings.peer_timeout:
            return []  # what this process slept through was nobody's silence
        problem = self.odometry.lasting_problem(now, settings)
        if not problem or template_of(problem) in self._reported:
            return []
        self._reported.add(template_of(problem))
        return [Say(f'nothing can be learnt from what is driven now: {problem}', warns=True)]

    def _leave_alone(self, now: float) -> Outputs:
        """End the demonstration of a teacher who is gone; it can be kept later all the same."""
        self.ended_because, self.ended_code = _LEFT_ANSWER, 'left'
        self._state.go(Phase.IDLE, now)
        return [Abandon(LEFT), Say(
            f'The recording of the drive has ended, because {LEFT}. The drive is there, but not '
            f'learnt: press y in teleop_node to keep it all the same, d to take it away',
            warns=True)]
