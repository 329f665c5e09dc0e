"""Refusing commands that were sent too long ago, with the name of who sent them."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from control_field_node.inputs.input_monitor import InputMonitor
from control_field_node.settings import Settings
from msgs_bridge.messages.poses import seconds_from_stamp
from msgs_bridge.node.command_age import problem_with_age


class CommandAgeCheck:
    """
    Checks the stamps of commands; counts those that are too old, and logs each topic once.

    Parameters
    ----------
    inputs : InputMonitor
    publishers_on : callable
        Returns the names of the other nodes that publish on a topic.

    """

    def __init__(
        self, inputs: InputMonitor, publishers_on: Callable[[str], Sequence[str]],
    ) -> None:
        """Start with no sender known."""
        self._inputs, self._publishers_on = inputs, publishers_on
        self._senders: dict[str, str] = {}

    def check(
        self, msg: Any, topic: str, settings: Settings, clock: float, odometry: Any, now: float,
    ) -> str:
        """
        Take in a command; return why it is too old, empty if it may be obeyed.

        Parameters
        ----------
        msg : Twist or TwistStamped
        topic : str
            On which it came.
        settings : Settings
            In lock-step nothing is ever old.
        clock, now : float, [s]
            The time that stamps are made of, and the steady one.
        odometry : Odometry or None
            The newest; a command may be stamped by its clock.

        """
        if settings.lockstep or not settings.is_stamped:
            return ''
        clocks = [clock]
        if odometry is not None and not self._inputs.odometry.is_stale(now):
            clocks.append(seconds_from_stamp(odometry.header.stamp))
        limit_name = limit_for(topic, settings)
        problem_of = partial(problem_with_age, msg, clocks, getattr(settings, limit_name),
                             limit_name=limit_name)
        if not problem_of(source=topic):
            return ''
        if topic not in self._senders:
            self._senders[topic] = senders_on(topic, self._publishers_on(topic)) or topic
        problem = problem_of(source=self._senders[topic])
        if topic == 'cmd_vel':
            problem += ('; it takes no trial over: a robot that looks at stamps drops it, any '
                        'other obeys it until our next command: end what sends it')
        self._inputs.refusals.counts['old commands'] += 1
        self._inputs.refusals.refuse(problem)
        return problem


def limit_for(topic: str, settings: Settings) -> str:
    """
    Return the name of the setting that says how old commands may be.

    What comes on `cmd_vel` is for the base, and counts for as long as that may obey it.
    """
    is_for_base = topic == 'cmd_vel' and settings.cmd_vel_timeout > settings.takeover_timeout
    return 'cmd_vel_timeout' if is_for_base else 'takeover_timeout'


def senders_on(topic: str, names: Sequence[str]) -> str:
    """Return who may have sent what came on a topic; empty where nobody is known."""
    if not names:
        return ''
    return f'{"one of " if len(names) > 1 else ""}{", ".join(names)} on {topic}'
