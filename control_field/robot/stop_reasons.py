"""Why the robot was stopped: a name, a sentence, and what it means for the trial."""

from enum import StrEnum
from typing import Final

from control_field.records import Outcome


class StopReason(StrEnum):
    """Why the robot was stopped."""

    STALE_ODOMETRY = 'stale_odometry'
    LATE_POSES = 'late_poses'
    LATE_COMMANDS = 'late_commands'
    STALE_NEIGHBOURHOOD = 'stale_neighbourhood'
    CLOCK_JUMPED_BACK = 'clock_jumped_back'
    OUTSIDE_WORKSPACE = 'outside_workspace'
    POSE_JUMPED = 'pose_jumped'
    NO_FIELD = 'no_field'
    WRONG_FIELD = 'wrong_field'
    LOW_COHERENCE = 'low_coherence'
    NO_PROGRESS = 'no_progress'
    STALLED = 'stalled'
    CONTACT = 'contact'
    TOUCHED = 'touched'
    STEP_LIMIT = 'step_limit'
    TIME_LIMIT = 'time_limit'
    NO_WAY = 'no_way'
    TAKEN_OVER = 'taken_over'
    OTHER_PUBLISHER = 'other_publisher'
    BAD_INPUT = 'bad_input'
    SHUTDOWN = 'shutdown'
    ASKED = 'asked'
    NO_HEARTBEAT = 'no_heartbeat'
    READING_FIELD = 'reading_field'

    @property
    def sentence(self) -> str:
        """Say it in one sentence."""
        return _SENTENCES[self]

    def sentence_with(self, detail: str) -> str:
        """Say it in one sentence, with what is known beyond that."""
        return f'{self.sentence}: {detail}' if detail else self.sentence

    @property
    def outcome(self) -> Outcome | None:
        """Return how the trial ends by it; None where it is only paused."""
        return _OUTCOMES.get(self)

    @property
    def end_sentence(self) -> str:
        """Say that a pause is over: what has changed for the better."""
        return _ENDS.get(self, f'no longer so that {self.sentence}')


_SENTENCES: Final = {
    StopReason.STALE_ODOMETRY: 'no usable odometry has arrived in time',
    StopReason.LATE_POSES: 'odometry arrives too late to drive by',
    StopReason.LATE_COMMANDS: 'the robot does not do in time what it is told',
    StopReason.STALE_NEIGHBOURHOOD: 'no usable neighbourhood has arrived in time',
    StopReason.CLOCK_JUMPED_BACK: 'the stamps of the odometry went back in time',
    StopReason.OUTSIDE_WORKSPACE: 'the robot has left the workspace',
    StopReason.POSE_JUMPED: 'the pose moved farther than the robot can drive',
    StopReason.NO_FIELD: 'there is no control field',
    StopReason.WRONG_FIELD: 'the control field that arrived belongs to something else',
    StopReason.LOW_COHERENCE: 'nothing was learnt here and the field names no clear course',
    StopReason.NO_PROGRESS: 'the robot has not come forward',
    StopReason.STALLED: 'the robot was told to drive and does not move',
    StopReason.CONTACT: 'the robot has touched something',
    StopReason.TOUCHED: 'something has run into the standing robot',
    StopReason.STEP_LIMIT: 'the step limit is reached',
    StopReason.TIME_LIMIT: 'the time limit is reached',
    StopReason.NO_WAY: 'there is no way left to try',
    StopReason.TAKEN_OVER: 'a person is driving',
    StopReason.OTHER_PUBLISHER: 'another controller publishes cmd_vel',
    StopReason.BAD_INPUT: 'a message is not to be trusted',
    StopReason.SHUTDOWN: 'the controller is shutting down',
    StopReason.ASKED: 'the trial was stopped by request',
    StopReason.NO_HEARTBEAT: 'nobody watches over the trial any more: teleop_node fell silent',
    StopReason.READING_FIELD: 'a control field is being taken over',
}

#: What ends a pause.
_ENDS: Final = {
    StopReason.STALE_ODOMETRY: 'odometry arrives again',
    StopReason.STALE_NEIGHBOURHOOD: 'the local grid arrives again',
    StopReason.TAKEN_OVER: 'nobody is driving any more',
    StopReason.TOUCHED: 'nothing touches the robot any more',
    StopReason.LATE_POSES: 'odometry arrives in time again',
    StopReason.LATE_COMMANDS: 'it has stood for so long that nothing sent before comes any more',
    StopReason.READING_FIELD: 'the control field is taken over',
    StopReason.BAD_INPUT: 'its messages are good again',
}

#: Reasons that end a trial; the others pause it. After an aborted one nothing is learnt, because
#: its record of where the robot was cannot be trusted.
_OUTCOMES: Final = {
    StopReason.CLOCK_JUMPED_BACK: Outcome.ABORTED,
    StopReason.POSE_JUMPED: Outcome.ABORTED,
    StopReason.SHUTDOWN: Outcome.ABORTED,
    StopReason.OUTSIDE_WORKSPACE: Outcome.STOPPED,
    StopReason.LOW_COHERENCE: Outcome.STOPPED,
    StopReason.NO_PROGRESS: Outcome.STOPPED,
    StopReason.ASKED: Outcome.STOPPED,
    StopReason.NO_HEARTBEAT: Outcome.STOPPED,
    StopReason.NO_FIELD: Outcome.STOPPED,
    StopReason.WRONG_FIELD: Outcome.STOPPED,
    StopReason.OTHER_PUBLISHER: Outcome.STOPPED,
    StopReason.STALLED: Outcome.COLLISION,
    StopReason.CONTACT: Outcome.COLLISION,
    StopReason.STEP_LIMIT: Outcome.GAVE_UP,
    StopReason.TIME_LIMIT: Outcome.GAVE_UP,
    StopReason.NO_WAY: Outcome.GAVE_UP,
}
