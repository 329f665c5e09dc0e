"""A learner's session that a test tells what happens."""

from operator import attrgetter

from control_field.poses import StartPose
from control_field.records import Outcome
from learner_node.session.outputs import Say
from learner_node.session.session import Session
from learner_node.settings import Settings
from msgs_bridge.messages.trial_status import State, TrialStatus

START = StartPose(0.625, 0.875, 0.0)
HERE = (START.x, START.y, START.yaw)


class Play:
    """A session with a clock and a log of all its outputs; calls it, or a part, by name."""

    def __init__(self, **changes):
        self.now = 0.0
        settings = Settings(simulation=True, **changes)
        self.session = Session(settings, lambda: START)
        self.log = []

    def __call__(self, name, *arguments):
        outputs = attrgetter(name)(self.session)(*arguments, self.now) or []
        self.log += outputs
        return outputs

    def wait(self, seconds):
        """Let time pass, tick by tick; return the outputs."""
        found = []
        for _ in range(round(seconds / 0.05)):
            self.now += 0.05
            found += self('tick')
        return found

    @property
    def phase(self):
        return self.session.state.phase


def idle(revision=1, trial=0):
    return TrialStatus(State.IDLE, trial, revision=revision)


def running(trial=1, revision=1, decisions=0, stamp=0.0):
    return TrialStatus(
        State.RUNNING, trial, revision=revision, decisions=decisions, stamp=stamp)


def ended(trial=1, outcome=Outcome.GOAL, decisions=3, reason='', stamp=0.0, stop_reason=None):
    return TrialStatus(State.ENDED, trial, outcome, reason, decisions=decisions, revision=1,
                       stamp=stamp, stop_reason=stop_reason)


def warnings_of(outputs):
    return [output.text for output in outputs if isinstance(output, Say) and output.warns]
