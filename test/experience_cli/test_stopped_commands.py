"""A command that changes bags and is stopped anywhere leaves them as they were, or done."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from ros_helpers import ROOT
from stop_commands import state_of

IMPORT = ['learn', '{}/sample/0001_demo', '{}/sample/0001_demo', '--into', '{}/shelf', '--quiet']
COMMANDS = [
    ('kill', IMPORT),
    ('interrupt', ['learn', '{}/sample/0001_demo', '--into', '{}/sample', '--quiet']),
    ('kill', ['trim', '{}/sample/0001_demo', '--from', '0.5']),
    ('kill', ['forget', '{}/sample/0002_trial']),
    ('kill', ['label', '{}/sample/0002_trial', 'success']),
    ('kill', ['repair', '{}/sample/0003_trial'])]


@pytest.mark.slow
def test_it_is_done_or_not_begun(tmp_path):
    bags = tmp_path / 'bags'
    shutil.copytree(ROOT / 'bags/sample', bags / 'sample')
    damaged = bags / 'sample/0003_trial/0003_trial_0.mcap'
    damaged.write_bytes(damaged.read_bytes()[:-400])
    before = state_of(bags)
    process = subprocess.run(
        [sys.executable, str(ROOT / 'test/stop_commands.py'), str(bags), str(tmp_path / 'scratch'),
         json.dumps(COMMANDS)], capture_output=True, text=True, cwd=ROOT, check=False,
        env=os.environ | {'PYTHONPATH': str(ROOT)})
    assert process.returncode == 0, process.stderr
    for (how, command), found in zip(COMMANDS, json.loads(process.stdout), strict=True):
        where = f'{how} {command[0]}, operation'
        assert found['done'] != before, where
        assert found['left'] == [], where
        whole = before.items() | found['done'].items()
        for number, states in enumerate(found['afterwards'], start=1):
            assert states.items() <= whole, f'{where} {number}'
            assert len(states) >= len(before), f'{where} {number}'
