"""
What a ROS process needs of its environment, without importing ROS.

The PyPI wheels of ROS 2 set ``LD_LIBRARY_PATH`` and a mark of their own when rclpy is first
imported, by starting the interpreter anew. A child that inherits the mark but not the path fails
to load anything; a child that inherits neither finds its own way.
"""

from collections.abc import Mapping
import os
from pathlib import Path
import sys

_MARK = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'


def prepare() -> None:
    """Let the share folders of the wheels be found; an environment that is set up is kept."""
    if not os.environ.get('AMENT_PREFIX_PATH'):
        os.environ['AMENT_PREFIX_PATH'] = sys.prefix


def child_environment(extra: Mapping[str, str] | None = None) -> dict[str, str]:
    """
    Return the environment for a child process that imports rclpy and these packages.

    Parameters
    ----------
    extra : mapping of str to str, optional
        Variables to set on top, such as ``ROS_DOMAIN_ID``.

    Returns
    -------
    dict
        A copy of this process's environment with what the child needs; the process's own stays
        as it is.

    """
    environment = dict(os.environ)
    if not environment.get('AMENT_PREFIX_PATH'):
        environment['AMENT_PREFIX_PATH'] = sys.prefix
    if not environment.get('LD_LIBRARY_PATH'):
        environment.pop(_MARK, None)
    root = Path(__file__).resolve().parent.parent
    if root.name not in ('site-packages', 'dist-packages'):
        environment['PYTHONPATH'] = _with_path(environment.get('PYTHONPATH', ''), str(root))
    environment.update(extra or {})
    return environment


def _with_path(paths: str, path: str) -> str:
    known = [part for part in paths.split(os.pathsep) if part]
    return os.pathsep.join(known if path in known else [*known, path])
