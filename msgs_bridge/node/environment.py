"""
What a ROS process needs of its environment, without importing ROS.

The PyPI wheels of ROS 2 set ``LD_LIBRARY_PATH`` and a mark of their own when rclpy is first
imported, by starting the interpreter anew. A child that inherits the mark but not the path fails
to load anything; a child that inherits neither finds its own way.
"""

from collections.abc import Mapping
import os
from pathlib import Path
import signal
import stat
import sys
import tempfile
from typing import Final

#: Ctrl-C, `kill`, and a window that is closed.
ENDING_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_MARK = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'


def prepare() -> None:
    """
    Let the share folders of the wheels be found, and let the log have a place without a home.

    An environment that is set up is kept.
    """
    if not os.environ.get('AMENT_PREFIX_PATH'):
        os.environ['AMENT_PREFIX_PATH'] = sys.prefix
    is_chosen = os.environ.get('ROS_LOG_DIR') or os.environ.get('ROS_HOME')
    if not is_chosen and not has_home('.ros/log'):
        os.environ['ROS_LOG_DIR'] = str(folder_without_home() / 'log')


def has_home(folder: str) -> bool:
    """Return whether a folder in the user's home is there, or can be made, to write to."""
    home = os.environ.get('HOME')
    if not home:
        return False
    try:
        path = Path(home) / folder
        path.mkdir(parents=True, exist_ok=True)
        return os.access(path, os.W_OK)
    except OSError:
        return False


def folder_without_home() -> Path:
    """Return a folder that is this user's alone, for what belongs into a home."""
    folder = Path(tempfile.gettempdir()) / f'experience_controller_{os.getuid()}'
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        about = folder.lstat()
        if stat.S_ISDIR(about.st_mode) and about.st_uid == os.getuid():
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp())  # somebody else has made one of that name


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
    root = Path(__file__).resolve().parents[2]
    if root.name not in ('site-packages', 'dist-packages'):
        environment['PYTHONPATH'] = _with_path(environment.get('PYTHONPATH', ''), str(root))
    environment.update(extra or {})
    return environment


def _with_path(paths: str, path: str) -> str:
    known = [part for part in paths.split(os.pathsep) if part]
    return os.pathsep.join(known if path in known else [*known, path])
