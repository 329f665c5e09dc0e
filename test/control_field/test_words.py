"""Counts in sentences."""

import pytest

from control_field.drives.demonstration import DemonstrationReport
from control_field.words import counted


@pytest.mark.parametrize(('n', 'text'), [(0, '0 cells'), (1, '1 cell'), (2, '2 cells')])
def test_one_is_singular(n, text):
    assert counted(n, 'cell') == text


def test_a_report_counts_in_sentences():
    assert str(DemonstrationReport(1, 1, 1, 1, 1, 1, 1, 1)) == (
        '1 cell from 1 pose, 1 pose of standing still at the start dropped, 1 pose of standing '
        'still at the end dropped, 1 pose of standing still in between not learnt, 1 pose on '
        'the edge outside the workspace dropped, 1 cell filled in between poses far apart')
