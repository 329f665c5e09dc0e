"""What a demo finds in its folder is not lost."""

import pytest

from experience_cli.commands.demo import _prepare
from experience_cli.errors import UserError


def taught(out, text):
    """Leave a bag in the folder of a demo."""
    bag = out / 'bags' / 'task1' / '0001_demo'
    bag.mkdir(parents=True)
    (bag / 'file').write_text(text)


def test_the_bags_of_the_demo_before_are_set_aside_and_that_is_said(tmp_path, capsys):
    assert _prepare(tmp_path, ['task1']) == tmp_path
    assert capsys.readouterr().out == ''
    for text in ('first', 'second'):
        taught(tmp_path, text)
        _prepare(tmp_path, ['task1', 'task2'])
        assert not (tmp_path / 'bags' / 'task1').exists()
        assert (tmp_path / 'before' / 'task1' / '0001_demo' / 'file').read_text() == text
        assert f'are in {tmp_path / "before" / "task1"}' in capsys.readouterr().out


def test_bags_that_no_demo_has_made_stay(tmp_path):
    taught(tmp_path, 'mine')
    with pytest.raises(UserError, match='holds bags that no demo has made'):
        _prepare(tmp_path, ['task1'])
    assert (tmp_path / 'bags' / 'task1' / '0001_demo' / 'file').read_text() == 'mine'
