"""The outputs of the session become bags, messages, requests and log lines here."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from sensor_msgs.msg import PointCloud2

from control_field.records import Outcome
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeFolder, EpisodeKind
from episode_store.undo import THROWN_AWAY, UNDO
from learner_node.publications import Publications
from learner_node.recording.message_queue import RawMessage
from learner_node.recording.recorder import BagGoneError, Recorder
from learner_node.recording.topics import type_name
from learner_node.requests import Requests
from learner_node.session.outputs import (
    Abandon, Close, Discard, Output, Outputs, Place, Record, Say, StartTrial, StopTrial)
from msgs_bridge.messages.serialized import cdr_from_message
from msgs_bridge.messages.trial_status import State, status_from_trial, TrialStatus


class OutputHandler:
    """
    Carries out the outputs of the session.

    Parameters
    ----------
    node : LearnerNode
        Tells people, learns from what was recorded, and is told when nothing can be recorded.
    recorder : Recorder
    publications : Publications
    requests : Requests

    """

    def __init__(
        self, node: Any, recorder: Recorder, publications: Publications, requests: Requests,
    ) -> None:
        self._node = node
        self._recorder = recorder
        self._publications, self._requests = publications, requests
        self.bag = ''  #: name of what is recorded, or was last

    def carry_out(self, outputs: Outputs) -> None:
        """Carry out outputs in order; stop at the first that cannot be recorded."""
        for output in outputs:
            if not self.guard(partial(self._do, output)):
                return

    def guard(self, work: Callable[[], Any]) -> bool:
        """Do work on the bag; return False, after `lose`, if that fails."""
        try:
            work()
        except BagError as error:
            self.lose(error)
            return False
        return True

    def _do(self, output: Output) -> None:
        match output:
            case Record(kind):
                self._record(kind)
            case Close():
                self._close_and_learn()
            case Abandon(reason, trial):
                self._abandon(reason, trial)
            case Discard():
                self._discard()
            case Place(pose):
                self._publications.place(pose, self._node.odometry_time * 1e-9)
            case StartTrial():
                self._requests.start(self._node.on_answer)
            case StopTrial():
                self._requests.stop(self._node.on_stop_answer)
            case Say(text, warns):
                self._node.say(text, warns)

    def _record(self, kind: EpisodeKind) -> None:
        episode = self._recorder.start(kind, self._node.now())
        self.bag = episode.name
        if kind is EpisodeKind.DEMO:
            self._write_status(State.RUNNING, 0)
        then = ': drive the robot to the goal, then press n' if kind is EpisodeKind.DEMO else ''
        self._node.say(f'recording {episode.name}{then}')
        self._node.tell()  # at once: nothing else is to drive the robot from now on

    def _close_and_learn(self) -> None:
        if self._recorder.kind is EpisodeKind.DEMO:
            self._write_status(State.ENDED, 0, Outcome.GOAL, 'the demonstration was kept')
        episode: EpisodeFolder | None = self._recorder.close()
        if episode is not None:
            self._node.learn(episode)

    def _discard(self) -> None:
        """Take a demonstration away, which can be undone; remove a trial that never began."""
        if self._recorder.kind is not EpisodeKind.DEMO:
            self._recorder.discard()
            return
        self._write_status(State.ENDED, 0, Outcome.ABORTED, THROWN_AWAY)
        episode = self._recorder.throw_away()
        if episode is not None:
            self._node.say(f'{episode.name} is thrown away ({UNDO})')

    def _abandon(self, reason: str, trial: int) -> None:
        if reason and self._recorder.kind is not None:
            self._write_status(State.ENDED, trial, Outcome.ABORTED, reason)
        episode = self._recorder.close()
        if episode is not None:
            self._node.learning.note_gaps(episode)

    def lose(self, error: BagError) -> None:
        """Report that nothing can be recorded any more; the robot is stopped, bags are kept."""
        kept = '' if isinstance(error, BagGoneError) else ', what was recorded is kept'
        self._node.failed(str(error), f'{error}; the robot is stopped{kept}')

    def _write_status(
        self, state: State, trial: int, outcome: Outcome | None = None, reason: str = '',
    ) -> None:
        """Write the status of the episode into its bag, as the learner sees it."""
        status = TrialStatus(state, trial, outcome, reason, stamp=self._node.odometry_time * 1e-9)
        task = self._recorder.task.task
        self._recorder.write(self._raw('trial', status_from_trial(status, task)))

    def latch(self, clouds: Mapping[str, bytes]) -> None:
        """Let every bag begin with PointCloud2 messages, in bytes, by topic."""
        self._recorder.latched = [
            RawMessage(self._node.resolve_topic_name(topic), type_name(PointCloud2), cdr,
                       self._node.now()) for topic, cdr in clouds.items()]

    def _raw(self, topic: str, message: Any) -> RawMessage:
        """Return a message of the learner's own in the form in which others arrive."""
        return RawMessage(self._node.resolve_topic_name(topic), type_name(type(message)),
                          cdr_from_message(message), self._node.now())
