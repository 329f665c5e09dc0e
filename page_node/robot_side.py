"""The robot's side of the page: what is known of it, what buttons do, and what is shown."""

from collections.abc import Callable
import time
from typing import Any, Final

from control_field.robot.limits import Velocity
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.answers import Answer
from msgs_bridge.teaching.coded_clients import CodedClients
from msgs_bridge.teaching.robot_placement import RobotPlacement
from msgs_bridge.teaching.status_tracker import problem_with_readers, StatusTracker
from msgs_bridge.teaching.teaching import Teaching
from msgs_bridge.teaching.timeouts import Timeouts
from msgs_bridge.teaching.velocity_publisher import VelocityPublisher
from page_node.actions.page_teaching import PageTeaching
from page_node.actions.wanted import Wanted
from page_node.driving.drive_watch import DriveWatch
from page_node.settings import Settings
from page_node.view.live_view import LiveView, Surroundings, Viewers
from page_node.view.topics import subscribe
from page_node.worlds.changer import Changer, Standing

#: How often is looked who hears the commands, [s].
_READERS_PERIOD: Final = 1.0
_UNDER_WAY: Final = (State.RUNNING, State.PAUSED)


class RobotSide:
    """
    Knows robot, learner and controller, and is asked by the page.

    Parameters
    ----------
    node : Node
    settings : Settings
        Of the page when it starts.
    watch : DriveWatch
        Drives.
    peers : PeerMonitor
    viewers : Viewers
        Where frames go.
    timeouts : Timeouts
    set_speeds : callable
        Sets the speeds of a full push, [m/s] and [rad/s]; returns what is wrong with them.

    """

    def __init__(
        self, node: Any, settings: Settings, watch: DriveWatch, peers: Any, viewers: Viewers,
        timeouts: Timeouts, set_speeds: Callable[[Velocity], str],
    ) -> None:
        """Ask for nothing yet."""
        self._node, self._watch, self._peers = node, watch, peers
        self._set_speeds = set_speeds
        self.status = StatusTracker(
            self._full_name(settings.learner), self._full_name(settings.controller))
        self.placement = RobotPlacement(node, timeouts, settings.lockstep)
        clients = CodedClients(
            node, settings.learner, settings.controller, self.status, peers, timeouts)
        self.live = LiveView(viewers, self.status, Surroundings(
            self._conflict, self._driver, lambda: watch.speeds, lambda: self.teaching.tries_left,
            self._on_trial, settings.simulation, settings.robot_radius,
            self._has_other_cells))
        self.teaching = PageTeaching(
            Teaching(clients, self.placement, self.status, watch),
            lambda: self.live.is_simulated, self._speeds_set)
        self.changer = Changer(
            node, settings.simulator, settings.learner, timeouts, self._standing)

    def listen(
        self, commands: VelocityPublisher, topic: str, refuse: Callable[[ValueError], object],
        steady: Any,
    ) -> None:
        """
        Hear and show what the other nodes publish.

        Parameters
        ----------
        commands : VelocityPublisher
            Whose readers are looked at.
        topic : str
            Where they go.
        refuse : callable
            Is told what is wrong with a message.
        steady : Clock
            Of the timers.

        """
        subscribe(self._node, self.live, self.status, refuse, steady)
        self._node.create_timer(
            _READERS_PERIOD, lambda: self._look_at_readers(commands, topic), clock=steady)

    def _full_name(self, node: str) -> str:
        return node if node.startswith('/') else (
            f'{self._node.get_namespace().rstrip("/")}/{node}')

    def _conflict(self) -> str:
        """Return what keeps nodes from working together; empty if nothing does."""
        return next((each.text for each in self._peers.problems if each.prevents), '')

    def _has_other_cells(self) -> bool:
        """Return whether what was learnt is of other cells than the world has."""
        return any(each.is_of_cells and each.prevents for each in self._peers.problems)

    def _standing(self) -> Standing:
        """Return what has to be so before a world or a task becomes another one."""
        now = self.live.situation(time.monotonic())
        is_busy = now.status.phase not in ('', 'idle') or now.trial.state in _UNDER_WAY
        return Standing(self.status.learner_values.get('task', ''), is_busy,
                        self.live.is_simulated)

    def _driver(self) -> str:
        return 'nobody' if self._watch.driver is None else 'somebody'

    def _speeds_set(self, speeds: Velocity) -> Answer:
        problem = self._set_speeds(speeds)
        return Answer(not problem, problem, 'too_fast' if problem else '')

    def _on_trial(self, trial: TrialStatus) -> None:
        self.teaching.on_trial(trial)

    def _look_at_readers(self, commands: VelocityPublisher, topic: str) -> None:
        """Notice when nobody hears the commands, or who wants the other type; see what is over."""
        self.teaching.look()
        name = self._node.resolve_topic_name(topic)
        self.status.problem, _ = problem_with_readers(
            name, f'geometry_msgs/msg/{commands.kind.__name__}',
            self._node.get_subscriptions_info_by_topic(name))

    async def perform(self, wanted: Wanted) -> Answer:
        """Do what the page asks for; how it stands then is shown at once."""
        answer = await self.teaching.perform(wanted)
        self.live.refresh()
        return answer

    async def leave(self) -> None:
        """End what was begun here, before nobody watches it."""
        await self.teaching.leave()
