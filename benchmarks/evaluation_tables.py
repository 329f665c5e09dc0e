"""The tables of ``doc/evaluation.md``."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from experience_evaluation.experiment import LearningCurve
from experience_evaluation.report import summarise

Groups = dict[str, dict[str, list[LearningCurve]]]
#: Columns: heading, metric, digits.
_COLUMNS = (
    ('field_success', 'field_success', 3), ('success', 'success', 3),
    ('SPL of field_success', 'field_success_spl', 3), ('SPL of success', 'success_spl', 3),
    ('steps driven', 'steps', 0), ('collisions', 'collisions', 0),
    ('prototypes / free cells', 'hidden_neurons_share', 2))


def last_values(curves: Iterable[LearningCurve], metric: str) -> list[float]:
    """Return a metric of every curve after its last trial."""
    return [curve.after[-1][metric] for curve in curves]


def _cell(values: Sequence[float], digits: int) -> str:
    summary = summarise(values)
    if summary['median'] is None:
        return '-'
    low, high = summary['low'], summary['high']
    text = f'{summary["median"]:.{digits}f}'
    if f'{low:.{digits}f}' == f'{high:.{digits}f}':
        return text
    return f'{text} <sub>{low:.{digits}f} to {high:.{digits}f}</sub>'


def _flat(by_family: dict[str, list[LearningCurve]]) -> list[LearningCurve]:
    return [curve for curves in by_family.values() for curve in curves]


def _lines(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [f'| {" | ".join(header)} |', '|' + '---|' * len(header)]
    return '\n'.join(lines + [f'| {" | ".join(row)} |' for row in rows])


def method_table(results: Groups, detoured: Groups) -> str:
    """Return a row a method: metrics after all trials, and fidelity to a detour teacher."""
    rows = []
    for name, by_family in results.items():
        curves = _flat(by_family)
        fidelity = last_values(_flat(detoured[name]), 'fidelity')
        rows.append([name, *(_cell(last_values(curves, metric), digits)
                             for _, metric, digits in _COLUMNS), _cell(fidelity, 2)])
    header = ['method', *(title for title, _, _ in _COLUMNS), 'fidelity to a detour']
    return _lines(header, rows)


def ablation_table(results: Groups, detoured: Groups) -> str:
    """Return a row for each part switched off; field_success also for every family."""
    families = list(next(iter(results.values())))
    rows = []
    for name, by_family in results.items():
        curves = _flat(by_family)
        rows.append([
            name, *(f'{np.median(last_values(by_family[family], "field_success")):.3f}'
                    for family in families),
            *(f'{np.median(last_values(curves, metric)):.3f}'
              for metric in ('success', 'success_spl', 'hidden_neurons_share')),
            f'{np.nanmedian(last_values(_flat(detoured[name]), "fidelity")):.2f}'])
    header = ['switched off', *(f'field_success, {family}' for family in families), 'success',
              'SPL of success', 'prototypes / free cells', 'fidelity to a detour']
    return _lines(header, rows)


def write_section(path: Path, name: str, text: str) -> None:
    """
    Put text between the markers of a section of a document.

    Raises
    ------
    ValueError
        If the document has no such section.

    """
    start, end = f'<!-- {name}: written by a benchmark -->', f'<!-- end of {name} -->'
    document = path.read_text()
    if start not in document or end not in document:
        raise ValueError(f'{path} has no section between {start} and {end}')
    before, rest = document.split(start, 1)
    after = rest.split(end, 1)[1]
    path.write_text(f'{before}{start}\n{text}\n{end}{after}')
