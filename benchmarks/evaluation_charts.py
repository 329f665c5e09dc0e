"""The learning curves of ``doc/evaluation.md``."""

from pathlib import Path

import matplotlib as mpl
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
import numpy as np
from PIL import Image

from experience_evaluation.experiment import LearningCurve
from experience_evaluation.report import interval_of_median

mpl.use('Agg')

#: Method -> colour (Okabe and Ito, told apart by colour-blind readers too), style, label.
STYLES = {
    'ours': ('#D55E00', '-', 'ours'),
    'ours, profile paper': ('#E69F00', '-', "ours, the paper's profile"),
    'eq7': ('#E69F00', ':', 'equation 7 alone'),
    'replanner': ('#000000', '--', 'optimistic replanner'),
    'dyna_q+demo': ('#0072B2', '-', 'Dyna-Q + demonstration'),
    'prioritised_sweeping+demo': ('#56B4E9', '-', 'prioritised sweeping + demo.'),
    'q_learning+demo': ('#009E73', '-', 'Q-learning + demonstration'),
    'q_learning': ('#009E73', ':', 'Q-learning'),
    'nearest_prototype': ('#CC79A7', '-.', 'nearest prototype'),
}
TITLES = {
    'field_success': 'Starts from which the flow alone, without local grid, comes home',
    'success_spl': 'Success with local grid, weighted by path length (SPL)',
}


def draw_curves(
    results: dict[str, dict[str, list[LearningCurve]]], metric: str, path: Path,
) -> Path:
    """Draw a metric over the number of trials, a panel a family of worlds; return the path."""
    families = list(next(iter(results.values())))
    n_cols = min(3, len(families) + 1)
    n_rows = -(-(len(families) + 1) // n_cols)
    figure, grid = plt.subplots(
        n_rows, n_cols, figsize=(3.3 * n_cols, 2.6 * n_rows + 0.4), sharex=True, sharey=True,
        squeeze=False, layout='constrained')
    panels = list(grid.flat)
    for axes, family in zip(panels, families, strict=False):
        for name, style in STYLES.items():
            _draw(axes, results[name][family], metric, style)
        axes.set_title(family, fontsize=10, loc='left')
        axes.set_ylim(-0.02, 1.03)
        axes.grid(color='0.9')
        axes.spines[['top', 'right']].set_visible(False)
        axes.tick_params(labelbottom=True, labelsize=8)
        axes.set_xlabel('trials', fontsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
    _draw_legend(panels[len(families)], panels[0])
    for axes in panels[len(families) + 1:]:
        axes.set_axis_off()
    figure.suptitle(TITLES[metric], fontsize=11, x=0.01, ha='left')
    figure.savefig(path, dpi=110)
    plt.close(figure)
    with Image.open(path) as image:  # few colours: a third of the size
        small = image.convert('RGB').quantize(64)
    small.save(path, optimize=True)
    return path


def _draw(
    axes: Axes, curves: list[LearningCurve], metric: str, style: tuple[str, str, str],
) -> None:
    colour, line, label = style
    trials = [row['trials'] for row in curves[0].after]
    values = np.array([[row[metric] for row in curve.after] for curve in curves])
    is_ours = label == 'ours'
    axes.plot(trials, np.median(values, axis=0), line, color=colour, label=label,
              linewidth=2.4 if is_ours else 1.3, zorder=5 if is_ours else 3)
    if is_ours:
        # Of the median; the tables have it of all methods.
        band = np.array([interval_of_median(column) for column in values.T])
        axes.fill_between(trials, band[:, 0], band[:, 1], color=colour, alpha=0.18, linewidth=0,
                          label='ours, 95 % interval')


def _draw_legend(axes: Axes, source: Axes) -> None:
    """Use the free panel for the legend."""
    handles, labels = source.get_legend_handles_labels()
    axes.legend(handles, labels, loc='center left', fontsize=8.5, frameon=False)
    axes.set_axis_off()
