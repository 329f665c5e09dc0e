"""The phases of a session, and which of them follow each other."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Final


class SessionError(ValueError):
    """
    What was asked for cannot be done now.

    Parameters
    ----------
    message : str
        Why, and what to do.
    code : str
        Why, for a page that has words of its own.

    """

    def __init__(self, message: str, code: str) -> None:
        """Keep both."""
        super().__init__(message)
        self.code = code


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


#: From each phase to those that may follow it, and what leads there. When nothing can be recorded
#: any more, or the learner is stopped, `IDLE` follows any of them.
TRANSITIONS: Final[Mapping[Phase, Mapping[Phase, str]]] = {
    Phase.IDLE: {
        Phase.DEMONSTRATION: 'a person begins to show the way',
        Phase.WAITING: 'trials are asked for',
        Phase.TRIAL: 'somebody else has started a trial',
        Phase.LEARNING: 'the bags that are there are learnt from, at the start or once more'},
    Phase.DEMONSTRATION: {
        Phase.SETTLING: 'it is kept',
        Phase.IDLE: 'it is thrown away, a trial runs, or nobody is at the keys'},
    Phase.SETTLING: {
        Phase.LEARNING: 'nothing more comes in'},
    Phase.WAITING: {
        Phase.PLACING: 'everything is there',
        Phase.IDLE: 'the trials are stopped'},
    Phase.PLACING: {
        Phase.STARTING: 'the robot is at its start',
        Phase.WAITING: 'it does not get there, or a peer went away',
        Phase.IDLE: 'the trials are stopped'},
    Phase.STARTING: {
        Phase.TRIAL: 'it runs',
        Phase.FINISHING: 'it ended before it was seen to run',
        Phase.WAITING: 'it is broken off',
        Phase.IDLE: 'it is broken off, and no more are to be run'},
    Phase.TRIAL: {
        Phase.FINISHING: 'it has ended',
        Phase.WAITING: 'it is broken off',
        Phase.IDLE: 'it is broken off, and no more are to be run'},
    Phase.FINISHING: {
        Phase.FINISHING: 'its end is told once more',
        Phase.LEARNING: 'all of it has arrived',
        Phase.WAITING: 'it is broken off',
        Phase.IDLE: 'it is broken off, and no more are to be run'},
    Phase.LEARNING: {
        Phase.WAITING: 'more trials are to be run',
        Phase.IDLE: 'all is learnt'},
}

#: Phases with a trial's bag open.
IN_TRIAL: Final = (Phase.STARTING, Phase.TRIAL, Phase.FINISHING)
#: Phases with a bag open.
RECORDING: Final = (Phase.DEMONSTRATION, Phase.SETTLING, *IN_TRIAL)

#: What is under way, in a few words.
WORDS: Final = {
    Phase.IDLE: 'nothing is under way', Phase.DEMONSTRATION: 'a demonstration is recorded',
    Phase.SETTLING: 'a demonstration is being kept', Phase.LEARNING: 'learning',
    Phase.PLACING: 'the robot is being set back', Phase.STARTING: 'a trial is being started'}


#: The code of what is refused in a phase.
CODES: Final[Mapping[Phase, str]] = {
    Phase.DEMONSTRATION: 'recording', Phase.SETTLING: 'learning', Phase.LEARNING: 'learning',
    Phase.WAITING: 'trying', Phase.PLACING: 'trying', Phase.STARTING: 'trying',
    Phase.TRIAL: 'trying', Phase.FINISHING: 'trying'}


def remedy(phase: Phase) -> str:
    """Say how a person ends what is under way, as the end of a sentence; empty where it ends."""
    if phase is Phase.DEMONSTRATION:
        return '; press n in teleop_node to keep it, a to throw it away'
    running = phase in (Phase.WAITING, Phase.PLACING, Phase.STARTING, Phase.TRIAL)
    return '; press space in teleop_node to end that' if running else ''
