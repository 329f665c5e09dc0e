"""Why the robot did what it did at a moment: numbers and codes, the page has the words."""

import math
from typing import Any

from episode_store.episode import Episode
from episode_store.errors import NoSuchMomentError
from page_node.memory.opened import reading
from page_node.refusal import RefusedError


def why(bags: str, task: str, number: str, at: float) -> dict[str, Any]:
    """
    Return all there is to say of a moment.

    Returns
    -------
    dict
        As `about_moment` has it, what is no number as None; and ``outcome`` and ``stop_reason``
        beside the trial's ``reason``, ``no_heading`` (a `NoHeading`) beside ``no_course``.

    Raises
    ------
    RefusedError
        ``hole`` where nothing was recorded, ``no_moment`` where the drive does not reach, and
        whatever opening a bag may come to.

    """
    with reading(bags, task, number) as episode:
        about: dict[str, Any] = finite(_about(episode, at))
        return about


def _about(episode: Episode, at: float) -> dict[str, Any]:
    # Learning is imported in the working process only: who asks names the function, no more.
    from episode_store.explanation import check_recorded, Moment
    from episode_store.moment_report import about_moment

    at = min(at, episode.duration)
    try:
        check_recorded(episode, at)
    except NoSuchMomentError as error:
        raise RefusedError('hole', str(error)) from None
    moment = Moment(episode, at)
    about, status = about_moment(moment), moment.status
    if status is not None:
        about['trial'] |= {'outcome': str(status.outcome or ''),
                           'stop_reason': str(status.stop_reason or '')}
    about['no_heading'] = None if moment.heading is not None else str(moment.why_no_heading)
    return about


def finite(value: Any) -> Any:
    """Return JSON with None for numbers that are none."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def get_ready() -> None:
    """Import what a first answer would else wait for."""
    from episode_store import explanation, moment_report

    del explanation, moment_report
