"""The curves of worlds that change, for ``doc/evaluation.md``."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
import numpy as np
import numpy.typing as npt

from benchmarks.changing_mazes import Arrived, Maze
from experience_evaluation.experiment import LearningCurve, Row

plt.switch_backend('Agg')

#: Method -> colour (Okabe and Ito), style, label.
STYLES: Final = {
    'ours': ('#D55E00', '-', 'ours'),
    'forgetting_replanner': ('#000000', '-', 'replanner that forgets'),
    'replanner': ('#000000', ':', 'replanner that keeps its map'),
    'dyna_q++demo': ('#0072B2', '-', 'Dyna-Q+ + demonstration'),
    'dyna_q+demo': ('#0072B2', ':', 'Dyna-Q + demonstration'),
}
_MAZE_STYLES: Final = {
    'oracle': ('#999999', '--', 'knows everything'), 'ours': STYLES['ours'],
    'Dyna-Q+': ('#0072B2', '-', 'Dyna-Q+'), 'Dyna-Q': ('#0072B2', ':', 'Dyna-Q')}
_TITLES: Final = {
    'success': 'Success with local grid; at a dotted line the world changes',
    'field_success_spl': 'SPL of the field alone; at a dotted line the world changes',
}
#: Curves of every seed: task -> method -> curves.
Results = Mapping[str, Mapping[str, Sequence[LearningCurve]]]


def draw_changes(results: Results, metric: str, path: Path) -> Path:
    """Draw medians of a metric over the trials, a panel a task; return the path."""
    n_rows = -(-(len(results) + 1) // 3)
    figure, grid = plt.subplots(n_rows, 3, figsize=(10.0, 2.6 * n_rows + 0.4), sharey=True,
                                squeeze=False, layout='constrained')
    *panels, legend = list(grid.flat)[:len(results) + 1]
    for axes, (task, by_method) in zip(panels, results.items(), strict=True):
        for name, curves in by_method.items():
            _draw(axes, curves, metric, STYLES[name])
        for row in next(iter(by_method.values()))[0].at_changes:
            axes.axvline(row['trials'], color='0.4', linestyle=':', linewidth=1.0)
        axes.set_title(task, fontsize=10, loc='left')
        axes.set_ylim(-0.02, 1.03)
        _tidy(axes, 'trials')
    for axes in list(grid.flat)[len(results):]:
        axes.set_axis_off()
    legend.legend(*panels[0].get_legend_handles_labels(), loc='center left', fontsize=8.5,
                  frameon=False)
    return _save(figure, _TITLES[metric], path)


def _draw(axes: Axes, curves: Sequence[LearningCurve], metric: str, style: tuple[str, str, str],
          ) -> None:
    """Draw a method, broken where the world changes."""
    colour, line, label = style
    for index, stretch in enumerate(zip(*(stretches(curve) for curve in curves), strict=True)):
        values = np.array([[row[metric] for row in rows] for rows in stretch])
        axes.plot([row['trials'] for row in stretch[0]], np.median(values, axis=0), line,
                  color=colour, linewidth=2.2 if label == 'ours' else 1.3, label=label
                  if index == 0 else None, zorder=5 if label == 'ours' else 3)


def stretches(curve: LearningCurve) -> list[list[Row]]:
    """Return what was judged in each of the worlds, one after another."""
    begins = [row['trials'] for row in curve.at_changes]
    ends = [*begins, np.inf]
    return [[row for row in curve.after if row['trials'] <= ends[0]], *(
        [first, *(row for row in curve.after if begin < row['trials'] <= end)]
        for first, begin, end in zip(curve.at_changes, begins, ends[1:], strict=True))]


def draw_mazes(
    reached: Mapping[str, Mapping[str, Sequence[Arrived]]], mazes: Mapping[str, Maze], path: Path,
) -> Path:
    """Draw the mean of the goals reached over the steps, a panel a maze; return the path."""
    figure, (panels,) = plt.subplots(1, len(mazes), figsize=(8.0, 3.2), squeeze=False,
                                     layout='constrained')
    for axes, (name, maze) in zip(panels, mazes.items(), strict=True):
        for who, (colour, line, label) in _MAZE_STYLES.items():
            mean: npt.NDArray[np.float64] = np.mean(reached[name][who], axis=0)
            axes.plot(np.arange(1, len(mean) + 1), mean, line, color=colour, label=label)
        axes.axvline(maze.n_steps[0], color='0.4', linestyle=':', linewidth=1.0)
        axes.set_title(name, fontsize=10, loc='left')
        _tidy(axes, 'steps')
    panels[0].legend(fontsize=8.5, frameon=False)
    return _save(figure, 'Goals reached in the changing mazes of Sutton and Barto', path)


def _tidy(axes: Axes, x_label: str) -> None:
    axes.grid(color='0.9')
    axes.spines[['top', 'right']].set_visible(False)
    axes.tick_params(labelsize=8)
    axes.set_xlabel(x_label, fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))


def _save(figure: Figure, title: str, path: Path) -> Path:
    figure.suptitle(title, fontsize=11, x=0.01, ha='left')
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return path
