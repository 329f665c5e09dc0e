"""No command changes bags behind the back of a learner that runs."""

import shutil
import subprocess
import sys

import pytest

from experience_cli.main import main
from ros_helpers import ROOT

HOLD = """
import sys
from pathlib import Path
from msgs_bridge.bag_folder import TaskFolder
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
