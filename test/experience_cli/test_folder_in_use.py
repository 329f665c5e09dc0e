"""No command changes bags behind the back of a learner that runs."""

from pkgutil import resolve_name
import shutil

import pytest

from episode_store.lock import is_in_use
from episode_store.task_folder import TaskFolder
from experience_cli.main import main
from ros_helpers import ROOT


@pytest.fixture
def held(tmp_path):
    """Return the folder of a task that is recorded into, as long as this process lives."""
    shutil.copytree(ROOT / 'bags/sample', tmp_path / 'sample')
    TaskFolder(tmp_path, 'sample').hold()
    return tmp_path / 'sample'


@pytest.mark.parametrize('command', [
    ['label', '{}/0002_trial', 'success'], ['forget', '{}/0002_trial'],
    ['trim', '{}/0001_demo', '--to', '5'], ['repair', '{}/0002_trial']], ids=lambda c: c[0])
def test_it_is_refused_in_one_line_and_nothing_is_changed(held, capsys, command):
    before = {path: path.stat().st_mtime_ns for path in held.rglob('*')}
    assert main([word.format(held) for word in command]) == 2
    said = capsys.readouterr().err
    assert said.count('\n') == 1
    assert 'is in use by a learner that is running' in said
    assert {path: path.stat().st_mtime_ns for path in held.rglob('*')} == before


@pytest.mark.parametrize(('work', 'command'), [
    ('episode_store.relearn.Relearner.learn', ['label', '{}/0002_trial', 'success']),
    ('episode_store.relearn.Relearner.learn', ['forget', '{}/0002_trial']),
    ('episode_store.relearn.Relearner.learn', ['trim', '{}/0001_demo', '--to', '5']),
    ('experience_cli.commands.repair.repair_bag', ['repair', '{}']),
    ('experience_cli.external_bags.import_demonstration',
     ['learn', '{}/0001_demo', '--into', '{}', '--quiet'])], ids=lambda c: c[0])
def test_no_learner_can_start_until_a_command_is_done(tmp_path, monkeypatch, work, command):
    task = tmp_path / 'sample'
    shutil.copytree(ROOT / 'bags/sample', task)
    module, _, name = work.rpartition('.')
    place = resolve_name(module)
    original, seen = getattr(place, name), []

    def spy(*arguments):
        seen.append(is_in_use(task))
        return original(*arguments)

    monkeypatch.setattr(place, name, spy)
    assert main([word.format(task) for word in command]) == 0
    assert seen
    assert all(seen)
    assert not is_in_use(task)
