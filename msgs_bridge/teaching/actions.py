"""The actions of teaching, as keys, services and the page ask for them."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Final


class Action(StrEnum):
    """What a key or a service of the same name asks for."""

    START = 'start_demonstration'
    KEEP = 'keep'
    REDO = 'redo'
    CANCEL = 'cancel'
    DROP_LAST = 'drop_last'
    UNDO = 'undo'
    LABEL_SUCCESS = 'label_success'
    LABEL_FAILURE = 'label_failure'
    RUN_TRIALS = 'run_trials'
    SET_BACK = 'set_back'
    TEACH_HERE = 'teach_here'
    STOP = 'stop'
    QUIT = 'quit'


#: What is under way where an action has been asked for and is not done yet.
DOING: Final[Mapping[Action, str]] = {
    Action.START: 'starting to record', Action.KEEP: 'keeping the drive',
    Action.REDO: 'beginning the drive again', Action.CANCEL: 'throwing the drive away',
    Action.DROP_LAST: 'removing the last one', Action.UNDO: 'bringing the removed back',
    Action.LABEL_SUCCESS: 'noting that the last one went well',
    Action.LABEL_FAILURE: 'noting that the last one went wrong',
    Action.RUN_TRIALS: 'letting the robot try', Action.SET_BACK: 'setting the robot back',
    Action.TEACH_HERE: 'setting the robot to where teaching helps'}
