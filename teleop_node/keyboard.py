"""The keys of a terminal, and what they do."""

from collections.abc import Callable
from typing import NamedTuple

from msgs_bridge.teaching.actions import Action
from msgs_bridge.teaching.teaching import Teaching
from teleop_node.driving import FACTORS, MOVES, STANDING
from teleop_node.keys import ACTIONS, KeyParser, Press, RepeatDetector
from teleop_node.paste_filter import PASTED, PasteFilter
from teleop_node.terminal import Terminal
from teleop_node.velocity_commands import VelocityCommands

_CAPITALS = 'capital letters do not drive: is caps lock on?'


class Typed(NamedTuple):
    """What was typed since the last look, and whether a paste began."""

    presses: list[Press]
    is_pasted: bool


class Keyboard:
    """
    Reads keys from a terminal; what was pasted is left out.

    Parameters
    ----------
    terminal : Terminal or None

    """

    def __init__(self, terminal: Terminal | None) -> None:
        """Start with nothing typed."""
        self.is_gone = False  #: whether the terminal went away
        self._terminal = terminal
        self._parser, self._paste_filter = KeyParser(), PasteFilter()
        self._repeats = RepeatDetector()

    def read(self, now: float) -> Typed:
        """Return what was typed since the last look."""
        if self._terminal is None:
            return Typed([], False)
        data = self._terminal.read()
        self.is_gone |= data is None
        keys, is_pasted = self._paste_filter.filter(self._parser.feed(data or b'', now), now)
        return Typed([self._repeats.press(key, now) for key in keys], is_pasted)


class KeyBindings:
    """
    Does what keys ask for: drive, change the speeds, begin an action.

    Parameters
    ----------
    commands : VelocityCommands
    teaching : Teaching
        Knows whether there is something to stop.
    begin : callable
        Begins an action.
    change_speeds : callable
        Makes faster or slower, by a key of `driving.FACTORS`.
    say : callable
        Tells the person.

    """

    def __init__(
        self, commands: VelocityCommands, teaching: Teaching, begin: Callable[[Action], None],
        change_speeds: Callable[[str], None], say: Callable[[str], None],
    ) -> None:
        """Start with nothing pressed."""
        self._commands, self._teaching = commands, teaching
        self._begin, self._change_speeds = begin, change_speeds
        self._say = say

    def on_typed(self, typed: Typed, now: float) -> None:
        """Do what the keys ask for; a paste stops the robot."""
        if typed.is_pasted:
            self._stop_trials(is_asked=False)
            self._say(PASTED)
        for press in typed.presses:
            self._on_press(press, now)

    def _on_press(self, press: Press, now: float) -> None:
        key = press.key
        action = ACTIONS.get(key, Action.STOP)
        if key in MOVES and key != STANDING:
            self._commands.driving.press(key, now)
        elif key in FACTORS:
            self._change_speeds(key)
        elif action is not Action.STOP:
            self._commands.let_go()
            if press.is_new:
                self._begin(action)
        elif not self._stop_trials(is_asked=press.is_new and key in ACTIONS) and (
                press.is_new and key.lower() in MOVES and key != STANDING and key):
            self._say(_CAPITALS)

    def _stop_trials(self, is_asked: bool) -> bool:
        """Stop the robot, and what drives by itself, too; return whether that has begun."""
        self._commands.halt()
        begins = not self._teaching.is_stopping and (
            self._teaching.drives_by_itself or is_asked)
        if begins:
            self._begin(Action.STOP)
        return begins
