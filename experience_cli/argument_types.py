"""What a word on the command line has to be: a number, a place, a speed."""

import argparse
from collections.abc import Callable
import math
from typing import Final

#: Of a local grid, as `control_field.local_grid` has it: that imports NumPy.
_MAX_SIDE: Final = 61


def count(low: int, high: int) -> Callable[[str], int]:
    """Return the type of whole numbers between two bounds."""
    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f'{text!r} must be a whole number from {low} to {high}')
        return value

    return number


def point(text: str) -> tuple[float, float]:
    """Return a place ``X,Y``, [m]."""
    numbers = _numbers(text)
    if len(numbers) != 2:
        raise argparse.ArgumentTypeError(f'{text!r} is no point, write it as X,Y in metres')
    return numbers[0], numbers[1]


def change(text: str) -> tuple[int, str]:
    """Return what ``K:FILE`` says: a number of trials, and the world after them."""
    number, _, world = text.partition(':')
    if not (number.isascii() and number.isdigit() and world):
        raise argparse.ArgumentTypeError(
            f'{text!r} is no change of the world, write it as K:FILE: a number of trials and the '
            f'world after them')
    return int(number), world


def sight(text: str) -> int:
    """Return the side of a local grid, [cells]."""
    value = count(3, _MAX_SIDE)(text)
    if value % 2 == 0:
        raise argparse.ArgumentTypeError(
            f'{text!r} is no side of a local grid: the robot is in its middle, so it must be odd')
    return value


def distance(text: str) -> float:
    """Return a distance, [m]."""
    numbers = _numbers(text)
    if len(numbers) != 1 or numbers[0] < 0.0:
        raise argparse.ArgumentTypeError(f'{text!r} is no distance, must be 0 m or more')
    return numbers[0]


def speed(text: str) -> float:
    """Return a speed, [m/s]."""
    numbers = _numbers(text)
    if len(numbers) != 1 or numbers[0] <= 0.0:
        raise argparse.ArgumentTypeError(f'{text!r} is no speed, must be above 0 m/s')
    return numbers[0]


def radius(text: str) -> float:
    """Return the radius of a robot, [m]."""
    numbers = _numbers(text)
    if len(numbers) != 1 or not 0.0 <= numbers[0] <= 2.0:
        raise argparse.ArgumentTypeError(f'{text!r} is no radius, must be 0 to 2 m')
    return numbers[0]


def side(text: str) -> float:
    """Return the side of a cell, [m]."""
    numbers = _numbers(text)
    if len(numbers) != 1 or numbers[0] <= 0.0:
        raise argparse.ArgumentTypeError(f'{text!r} is no side of a cell, must be above 0 m')
    return numbers[0]


def _numbers(text: str) -> list[float]:
    """Return the numbers between commas; none if one of them is no finite number."""
    try:
        numbers = [float(part) for part in text.split(',')]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
