"""`experience learn`, `inspect` and `repair` on bags, and what users may get wrong."""

from dataclasses import replace
import json
from pkgutil import resolve_name
import sys

import numpy as np
from PIL import Image
import pytest
from rclpy.serialization import serialize_message

from bridge_helpers import demonstration_bag, GRID, random_decisions, raw_decisions, raw_status
from control_field.grid import Grid
from control_field.parameters import Parameters
from control_field.records import Outcome
from episode_store.episode import Episode
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.relearn import Relearner
from episode_store.task_folder import EpisodeKind, TaskFolder
from experience_cli.arguments import COMMANDS
from experience_cli.commands.learn import digest, field_bytes
from experience_cli.main import main
from msgs_bridge.messages.tables import cloud_from_field
from msgs_bridge.messages.trial_status import State
from ros_helpers import run
from sample_helpers import sample_copy


@pytest.fixture
def task(tmp_path):
    """Return a task with a demonstration."""
    folder = demonstration_bag(tmp_path)
    return TaskFolder(folder.parent.parent, folder.parent.name)


def relearner_of(task):
    header = Episode.at(task.episodes()[0].path).header
    relearner = Relearner(header.grid, header.parameters)
    for episode in task.episodes():
        relearner.learn(Episode(episode))
    return relearner


def add_trial(task, field=None, header=None):
    """Add a trial of three random decisions that begins with a recorded field."""
    header = header or Episode.at(task.episodes()[0].path).header
    mapping = EpisodeHeader(
        EpisodeKind.TRIAL, header.task, header.grid, header.parameters).to_mapping()
    with start_bag(task, EpisodeKind.TRIAL, mapping) as bag:
        if field is not None:
            bag.write('/control_field', 'sensor_msgs/msg/PointCloud2',
                      serialize_message(cloud_from_field(field)), 0)
        rows = random_decisions(header.grid, 3, 1)
        bag.write('/experience', 'sensor_msgs/msg/PointCloud2',
                  raw_decisions(rows, header.grid), 1)
        bag.write('/trial', 'diagnostic_msgs/msg/DiagnosticStatus', raw_status(
            State.ENDED, int(rows['trial'][-1]), Outcome.GAVE_UP, decisions=3, revision=1), 2)


class TestLearn:

    def test_says_what_every_bag_taught_and_the_hash(self, task, capsys):
        add_trial(task)
        assert main(['learn', str(task.path)]) == 0
        *lines, last = capsys.readouterr().out.splitlines()
        assert [line.split()[1] for line in lines] == ['demo', 'trial']
        assert last == f'control_field revision 2 sha256 {digest(relearner_of(task).field())}'

    def test_gives_the_same_bytes_in_another_process(self, task, tmp_path):
        command = [sys.executable, '-m', 'experience_cli.main', 'learn', '--quiet',
                   str(task.path)]
        process = run(command, tmp_path)
        assert digest(relearner_of(task).field()) in process.stdout, process.report()

    def test_takes_bags_in_the_order_of_their_numbers(self, task, capsys):
        add_trial(task)
        first, second = (str(episode.path) for episode in task.episodes())
        main(['learn', '--quiet', first, second])
        main(['learn', '--quiet', second, first])
        lines = capsys.readouterr().out.splitlines()
        assert lines[0] == lines[1]

    def test_saves_a_field_that_others_can_follow(self, task, tmp_path):
        path = tmp_path / 'new' / 'field.npz'
        assert main(['learn', str(task.path), '--save', str(path)]) == 0
        relearner = relearner_of(task)
        with np.load(path) as saved:
            np.testing.assert_array_equal(saved['vx'], relearner.field().vx)
            cells = relearner.refresh.prototypes.cells
            np.testing.assert_allclose(saved['centres'], GRID.world_from_cells(cells))
            assert saved['actions'].shape == (len(cells), 2)
            assert saved['q'].shape == (len(cells),)
            assert float(saved['resolution']) == GRID.resolution

    def test_check_accepts_the_field_that_was_in_force(self, task, capsys):
        add_trial(task, relearner_of(task).field())
        assert main(['learn', '--check', str(task.path)]) == 0
        assert capsys.readouterr().err == (
            'experience learn: --check: 1 bag with a recorded field, each is the relearnt one '
            'byte for byte\n')

    def test_check_passes_over_what_holds_no_field(self, task, capsys):
        demonstration_bag(task.root)
        assert main(['learn', '--check', str(task.path)]) == 0
        assert 'none of these bags holds a field' in capsys.readouterr().err

    def test_check_finds_a_field_that_was_not(self, task, capsys):
        relearner = relearner_of(task)
        field = relearner.field()
        add_trial(task, replace(field, revision=7))
        assert main(['learn', '--check', str(task.path)]) == 1
        assert '0002' in capsys.readouterr().err
        assert field_bytes(field) != b''

    @pytest.mark.parametrize(('words', 'said'), [
        (['label', 'sample/0002', 'failure'], 'sample/0002 was labelled failure'),
        (['trim', 'sample/0001', '--from', '3'], 'sample/0001 was cut'),
        (['forget', 'sample/0002'], 'sample/0002 was forgotten')])
    def test_check_names_what_people_have_changed_since(
        self, tmp_path, monkeypatch, capsys, words, said,
    ):
        sample_copy(tmp_path)
        monkeypatch.chdir(tmp_path)
        assert main(words) == 0
        assert main(['learn', '--check', 'bags/sample']) == 1
        [line] = capsys.readouterr().err.splitlines()
        assert 'differ' in line
        assert line.endswith(f'; since then {said}')

    def test_passes_over_a_last_bag_that_is_empty(self, task, capsys):
        start_bag(task, 'trial', {}).close()
        last = task.episodes()[-1]
        last.bag.write_bytes(b'')
        assert main(['learn', str(task.path)]) == 0
        assert 'nothing was learnt' in capsys.readouterr().out
        assert main(['inspect', str(task.path)]) == 0

    def test_wants_a_demonstration(self, task, mistake):
        add_trial(task)
        assert 'no demonstration' in mistake('learn', task.episodes()[1].path)

    def test_says_what_is_no_bag(self, tmp_path, mistake):
        assert str(tmp_path / 'nope') in mistake('learn', tmp_path / 'nope')
        assert 'holds no bags' in mistake('learn', tmp_path)

    def test_says_that_a_file_is_no_npz(self, task, mistake):
        assert '.npz' in mistake('learn', task.path, '--save', 'field.txt')

    def test_says_that_it_cannot_write(self, task, mistake, tmp_path):
        (tmp_path / 'file').touch()
        line = mistake('learn', task.path, '--save', tmp_path / 'file' / 'field.npz')
        assert 'cannot write' in line

    def test_names_both_workspaces_of_a_mixture(self, task, mistake):
        other = Grid(3, 4, 1.5)
        add_trial(task, header=EpisodeHeader(EpisodeKind.TRIAL, task.task, other, Parameters()))
        line = mistake('learn', task.path)
        assert '3 x 4 cells of 1.5 m' in line
        assert f'{GRID.n_rows} x {GRID.n_cols}' in line


def test_inspect_draws_a_picture(task, tmp_path, capsys):
    out = tmp_path / 'new' / 'picture.png'
    assert main(['inspect', str(task.path), '--out', str(out)]) == 0
    with Image.open(out) as picture:
        assert min(picture.size) > 500
        assert len(picture.convert('RGB').getcolors(1 << 24)) > 20
    assert 'prototypes' in capsys.readouterr().out


def test_inspect_puts_the_picture_beside_the_bags(task):
    assert main(['inspect', str(task.episodes()[0].path)]) == 0
    assert (task.path / '0001_demo.png').is_file()


def test_repair_mends_and_says_so(task, capsys):
    episode = task.episodes()[0]
    whole = episode.bag.read_bytes()
    episode.bag.write_bytes(whole[:len(whole) // 2])
    assert main(['repair', str(task.path)]) == 0
    assert 'mended' in capsys.readouterr().out
    assert main(['repair', str(task.path)]) == 0
    assert 'whole' in capsys.readouterr().out


def test_help_names_every_command(capsys):
    with pytest.raises(SystemExit, match='0'):
        main(['--help'])
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()
              if line.startswith('    ') and line[4] != ' ']
    assert listed == list(COMMANDS)


@pytest.mark.parametrize('name', COMMANDS)
def test_every_command_has_a_module_that_runs_it(name):
    assert callable(resolve_name(f'experience_cli.commands.{COMMANDS[name].module}:run'))


def test_help_loads_no_heavy_library(tmp_path):
    code = ('import sys; from experience_cli.main import main\n'
            'for words in ["--help"], ["learn", "--help"], ["evaluate", "--help"]:\n'
            '    try: main(words)\n'
            '    except SystemExit: pass\n'
            'print({"numpy", "numba", "rclpy", "matplotlib"} & set(sys.modules))')
    process = run([sys.executable, '-c', code], tmp_path)
    assert (process.popen.returncode, process.stderr) == (0, '')
    assert process.stdout.splitlines()[-1] == 'set()'


@pytest.mark.parametrize('arguments', [
    [], ['dance'], ['learn'], ['demo', '--trials', 'many'], ['show', 'a/0001', '--dance'],
    ['label', 'a/0001', 'splendid'], ['explain', 'a/0001', '--at', 'noon'],
    ['trim', 'a/0001', '--from'], ['evaluate', '--goal', '1'],
    ['evaluate', '--world', 'a', '--seeds', '0']])
def test_wrong_arguments_are_one_line_and_exit_code_2(capsys, arguments):
    with pytest.raises(SystemExit, match='2'):
        main(arguments)
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith('experience')
    assert '--help' in line


@pytest.mark.parametrize(('arguments', 'words'), [
    (['--tasks', '9'], ['task9']),
    (['--tasks', ','], ['--tasks']),
    (['--trials', '0'], ['--trials', '1']),
    (['--seed', '-1'], ['--seed']),
    (['--tasks', '1,1'], ['--tasks', 'one name']),
    (['--tasks', 'some/my map.yaml'], ['--tasks', "'my map'", 'letters']),
    (['--tasks', '../..'], ['--tasks', 'letters']),
    (['--tasks', '1,dyna'], ['dyna', '20 x 20 cells of 0.25 m']),
])
def test_demo_says_what_is_wrong(arguments, words, tmp_path, mistake):
    line = mistake('demo', '--out', tmp_path / 'out', *arguments)
    for word in words:
        assert word in line


def test_demo_does_not_touch_bags_that_no_demo_made(tmp_path, mistake):
    (tmp_path / 'bags' / 'task1' / '0001_demo').mkdir(parents=True)
    line = mistake('demo', '--out', tmp_path)
    assert '--out' in line
    assert (tmp_path / 'bags' / 'task1' / '0001_demo').is_dir()


@pytest.mark.parametrize('option', [
    ['--out', 'x'], ['--profile', 'full'], ['--seed', '0'], ['--realtime']])
def test_what_nodes_that_run_already_have_is_not_taken_with_attach(
    tmp_path, monkeypatch, mistake, option,
):
    monkeypatch.chdir(tmp_path)
    line = mistake('demo', '--attach', *option)
    assert f'{option[0]}: is not for --attach' in line
    assert not any(tmp_path.iterdir())


def test_demo_says_that_it_cannot_write(tmp_path, mistake):
    (tmp_path / 'file').write_text(json.dumps({}))
    assert 'cannot write' in mistake('demo', '--out', tmp_path / 'file')
