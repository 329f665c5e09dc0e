"""What there is to say of a bag: of its size, its workspace, and what it lacks."""

from dataclasses import asdict
from datetime import datetime
import shlex
import sys
from typing import Any

from control_field.drives.demonstration import DemonstrationReport
from control_field.grid import Grid
from control_field.records import Demonstration
from episode_store.episode import Episode


def demonstration_about(
    demonstration: Demonstration, report: DemonstrationReport, grid: Grid,
) -> dict[str, Any]:
    """Return what a demonstration is, ready for JSON."""
    cells = demonstration.cells.tolist()
    return {'start_cell': cells[0], 'goal_cell': cells[-1],
            'start': list(grid.world_from_cell(*cells[0])),
            'goal': list(grid.world_from_cell(*cells[-1])), 'report': asdict(report)}


def time_text(begun: float | None) -> str:
    """Return date and time of day where the robot lives, or that time is simulated."""
    if begun is None:
        return 'simulated'
    return datetime.fromtimestamp(begun).astimezone().strftime('%Y-%m-%d %H:%M')


def grid_text(grid: Grid) -> str:
    """Return a workspace in words."""
    return f'{grid.size} from ({grid.origin_x:.10g}, {grid.origin_y:.10g}) in {grid.frame_id}'


def size_text(size: int) -> str:
    """Return a size in kB or MB."""
    return f'{size / 1e6:.1f} MB' if size >= 1e6 else f'{size / 1e3:.0f} kB'


def say_cut(command: str, episode: Episode) -> None:
    """Say, in a line on stderr, what is missing of a bag that was not closed; change nothing."""
    damage, path = episode.damage, episode.path
    if damage.cut:
        advice = 'it is being recorded or changed just now' if damage.is_busy else (
            f'`experience repair {shlex.quote(str(path))}` mends it')
        print(f'experience {command}: {path} was not closed: {damage.cut}; {advice}',
              file=sys.stderr)


def say_gaps(command: str, episode: Episode) -> bool:
    """Say, in a line on stderr, what is missing in the middle of a bag; return whether any is."""
    gaps = episode.damage.gaps
    if gaps:
        print(f'experience {command}: {episode.folder.name}: {gaps}', file=sys.stderr)
    return bool(gaps)
