"""How old a stamped command is: who passes an old one on as new defeats a base that looks."""

from collections.abc import Iterable
from typing import Any, Final

from msgs_bridge.messages.poses import seconds_from_stamp

#: Age from which it is likelier that two clocks differ than that a command took so long, [s].
_OTHER_CLOCK: Final = 60.0


def problem_with_age(
    msg: Any, clocks: Iterable[float], limit: float, source: str, limit_name: str,
) -> str:
    """
    Say that a command is too old, or of another clock; empty if it may be obeyed.

    Parameters
    ----------
    msg : Twist or TwistStamped
        One without a stamp, or whose stamp is zero, tells no age and may be obeyed.
    clocks : iterable of float, [s]
        What commands may be stamped with: the time here, that of the odometry. The nearest
        counts.
    limit : float, [s]
        Greatest age; a stamp may lie as far ahead.
    source : str
        Where it came from: topic, and node where that is known.
    limit_name : str
        Of the parameter.

    """
    header = getattr(msg, 'header', None)
    stamp = 0.0 if header is None else seconds_from_stamp(header.stamp)
    ages = [clock - stamp for clock in clocks]
    if stamp == 0.0 or not ages:
        return ''
    age = min(ages, key=abs)
    if abs(age) <= limit:
        return ''
    clocks_differ = (f'the clocks of its sender and of this machine differ by {abs(age):.1f} s: '
                     f'set them, give both the same use_sim_time, or send a stamp of zero')
    if age < 0.0:
        return f'{source}: the stamp of a command is {-age:.1f} s ahead, so {clocks_differ}'
    return (f'{source}: a command is {age:.1f} s old, must be at most {limit_name} ({limit:g} s)'
            + (f'; if it was sent just now, {clocks_differ}' if age > _OTHER_CLOCK else ''))
