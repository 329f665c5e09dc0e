"""A command on a full disk ends in one line, and nothing is half written or lost."""

import json
import os
import resource
import shutil
import subprocess
import sys

from matplotlib.figure import Figure
import pytest

from experience_cli.demo.report import write_report
from experience_cli.errors import UserError
from experience_cli.figures.paper_figures import draw_figures
from ros_helpers import ROOT

BAG = '{}/bags/sample/0001_demo'
EVALUATE = ['evaluate', '--world', 'open', '--demo-start', '0.6,0.6', '--goal', '1.6,1.6',
            '--trials', '1', '--jobs', '1']
CHANGES = [
    ['learn', BAG, BAG, '--into', '{}/bags/shelf', '--quiet'],
    ['learn', BAG, '--into', '{}/bags/sample', '--quiet'],
    ['trim', BAG, '--from', '0.5'],
    ['label', '{}/bags/sample/0002_trial', 'success'],
    ['repair', '{}/bags/cut/0003_trial'],
    ['forget', '{}/bags/sample/0002_trial']]
OUTPUTS = [
    ['learn', '{}/bags/sample', '--save', '{}/field.npz', '--quiet'],
    ['inspect', BAG, '--out', '{}/picture.png'],
    [*EVALUATE, '--json', '{}/report.json']]


@pytest.fixture(scope='module')
def source(tmp_path_factory):
    """Return a folder with bags, one of them cut, and with an old output."""
    root = tmp_path_factory.mktemp('full') / 'source'
    shutil.copytree(ROOT / 'bags/sample', root / 'bags/sample')
    shutil.copytree(ROOT / 'bags/sample/0003_trial', root / 'bags/cut/0003_trial')
    damaged = root / 'bags/cut/0003_trial/0003_trial_0.mcap'
    damaged.write_bytes(damaged.read_bytes()[:-400])
    for name in ('field.npz', 'picture.png', 'report.json'):
        (root / name).write_text('what was there')
    return root


def rounds_of(source, folder, commands):
    """Run commands with more and more room; return what came of each."""
    (scratch := folder / 'scratch').mkdir()
    own = ['unshare', '--mount', *([] if os.getuid() == 0 else ['--map-root-user'])]
    mount = [*own, 'mount', '-t', 'tmpfs', 'tmpfs', str(scratch)]
    can_mount = shutil.which('unshare') and not subprocess.run(
        mount, capture_output=True, check=False).returncode
    script = [sys.executable, str(ROOT / 'test/full_disk.py'), 'disk' if can_mount else 'limit',
              str(source), str(scratch), json.dumps(commands)]
    process = subprocess.run(
        [*own, *script] if can_mount else script, capture_output=True, text=True, cwd=ROOT,
        check=False, env=os.environ | {
            'PYTHONPATH': os.pathsep.join((str(ROOT), str(ROOT / 'test')))})
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)


def test_figures_and_report_of_the_demo_stay_as_they_were_and_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr('experience_cli.figures.paper_figures.figures_of',
                        lambda _: [('figure_2', Figure())])
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for name, write in {
            'figure_2.png': lambda: draw_figures(tmp_path, []),
            'report.json': lambda: write_report(tmp_path / 'report.json', [], {})}.items():
        (tmp_path / name).write_text('what was there')
        # No file may grow beyond this; the error is much the same as of a full disk.
        resource.setrlimit(resource.RLIMIT_FSIZE, (10, limits[1]))
        try:
            with pytest.raises(UserError, match=f'cannot write .*{name}: File too large'):
                write()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert [path.read_text() for path in tmp_path.iterdir() if path.name == name] == [
            'what was there']
    assert {path.name for path in tmp_path.iterdir()} == {'figure_2.png', 'report.json'}


@pytest.mark.slow
def test_it_is_one_line_and_nothing_is_half_done(source, tmp_path):
    commands = [*CHANGES, *OUTPUTS]
    for command, rounds in zip(commands, rounds_of(source, tmp_path, commands), strict=True):
        assert rounds[-1]['code'] == 0, (command, rounds[-1])
        assert len(rounds) > 1 or command[0] == 'forget', command  # a name needs no room
        whole = rounds[0]['before'].items() | rounds[-1]['after'].items()
        for ended in rounds[:-1]:
            where = f'{" ".join(command)}: {ended["room"]} blocks: {ended["said"]}'
            assert ended['code'] == 2, where
            [line] = ended['said'].splitlines()
            assert line.startswith(f'experience {command[0]}: '), where
            assert 'no space left' in line.lower() or 'too large' in line.lower(), where
            # Each file is as it was, or as it is when all is done, and no other is there.
            assert ended['after'].items() <= whole, where
            assert ended['before'].keys() <= ended['after'].keys(), where
