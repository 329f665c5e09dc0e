"""Learning parameters that belong to a world of the demo."""

import pytest

from experience_cli.demo.task_settings import settings_for
from experience_cli.errors import UserError

FILE = '/**:\n  ros__parameters:\n    step_limit: 7\n'


def test_a_world_of_ours_may_have_settings():
    assert settings_for('dead_ends', '') == {'step_limit': 50, 'map_memory': 0}
    assert settings_for('task1', '') == {}
    assert settings_for('/somewhere/dead_ends.yaml', '') == {}


def test_others_are_named(tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text(FILE)
    assert settings_for('dead_ends', str(file)) == {'step_limit': 7}
    assert settings_for('task1', 'dead_ends') == settings_for('dead_ends', '')


@pytest.mark.parametrize(('text', 'why'), [
    ('', 'must hold /\\*\\*: ros__parameters'),
    ('[]', 'must hold /\\*\\*: ros__parameters'),
    ('learner_node:\n  ros__parameters:\n    step_limit: 7\n', 'must hold'),
    ('/**:\n  ros__parameters: 3\n', 'no parameters stand below'),
    (FILE.replace('7', 'many'), "step_limit is 'many', must be of type int"),
    (FILE.replace('step_limit', 'steps'), 'steps is no parameter'),
    (FILE.replace('step_limit', '7'), '7 is no parameter'),
    (': : :', 'no YAML'),
])
def test_what_is_wrong_with_a_file_is_said_in_a_line(tmp_path, text, why):
    file = tmp_path / 'mine.yaml'
    file.write_text(text)
    with pytest.raises(UserError, match=why) as caught:
        settings_for('dead_ends', str(file))
    assert str(caught.value).count('\n') == 0
    assert str(file) in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(UserError, match=f'cannot read {tmp_path / "none.yaml"}: No such file'):
        settings_for('dead_ends', str(tmp_path / 'none.yaml'))
    with pytest.raises(UserError, match=r'--settings none.*dead_ends'):
        settings_for('dead_ends', 'none')
