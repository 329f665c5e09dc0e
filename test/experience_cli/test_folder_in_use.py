"""No command changes bags behind the back of a learner that runs."""

from pkgutil import resolve_name
import shutil
import subprocess
import sys

import pytest

from episode_store.lock import is_in_use
from experience_cli.main import main
from ros_helpers import ROOT

HOLD = """
import sys
from pathlib import Path
from episode_store.task_folder import TaskFolder
TaskFolder(Path(sys.argv[1]), 'sample').hold()
print('held', flush=True)
sys.stdin.read()
"""


@pytest.fixture
def held(tmp_path):
    shutil.copytree(ROOT / 'bags/sample', tmp_path / 'sample')
    process = subprocess.Popen([sys.executable, '-c', HOLD, str(tmp_path)],
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == 'held\n'
    yield tmp_path / 'sample'
    process.kill()
    process.communicate()


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
    ('episode_store.relearn.Lessons.learn', ['label', '{}/0002_trial', 'success']),
    ('episode_store.relearn.Lessons.learn', ['forget', '{}/0002_trial']),
    ('episode_store.relearn.Lessons.learn', ['trim', '{}/0001_demo', '--to', '5']),
    ('episode_store.repair.repair_bag', ['repair', '{}']),
    ('episode_store.external.take_over.import_demonstration',
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
