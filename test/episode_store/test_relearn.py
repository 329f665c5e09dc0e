"""What the fold over bags tells beside the field; bags of several workspaces in one task."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest

from bridge_helpers import demonstration_bag, GRID, write_drive
from control_field.grid import Grid
from episode_store.episode import Episode
from episode_store.header import EpisodeHeader
from episode_store.making import start_bag
from episode_store.relearn import Relearner
from episode_store.rosbag2.errors import BagError
from episode_store.task_folder import EpisodeKind, TaskFolder
from episode_store.workspaces import check_workspaces
from experience_cli.main import main
from ros_helpers import ROOT

LARGER = Grid(30, 30, 0.25)
OTHER_FRAME = replace(GRID, frame_id='map')


@pytest.fixture(scope='module')
def relearner():
    task = TaskFolder(Path(ROOT) / 'bags', 'sample')
    episodes = task.episodes()
    header = Episode.at(episodes[0].path).header
    taught = Relearner(header.grid, header.parameters)
    for episode in episodes:
        taught.learn(Episode(episode))
    return taught


def test_places_to_teach_from_lie_apart_and_in_the_workspace(relearner):
    places = [relearner.grid.cell_from_world(x, y) for x, y in relearner.teach_here(4)]
    assert len(places) == 4
    assert all(relearner.grid.contains(*place) for place in places)
    assert all(max(abs(a - c), abs(b - d)) >= 4
               for (a, b), (c, d) in combinations(places, 2))


def test_no_more_places_than_asked_for(relearner):
    assert len(relearner.teach_here(2)) == 2


def test_what_the_learner_refuses_names_the_bag(relearner, monkeypatch):
    taught = Relearner(relearner.grid, relearner.parameters)
    bag = TaskFolder(Path(ROOT) / 'bags', 'sample').episodes()[0]
    # No drive is known that gets so far; should there be one, the commands say it in a line.
    monkeypatch.setattr(taught._learner.memory, 'grid', Grid(1, 1, 0.25))
    with pytest.raises(BagError, match=r'0001_demo cannot be learnt from: a demonstration leaves'):
        taught.learn(Episode(bag))


def add(task, grid):
    header = EpisodeHeader(EpisodeKind.DEMO, task.task, grid).to_mapping()
    with start_bag(task, EpisodeKind.DEMO, header) as bag:
        write_drive(bag, 60)


def task_of(root, grids):
    task = TaskFolder(root, 'task1')
    for grid in grids:
        add(task, grid)
    return task


@pytest.mark.parametrize('other', [LARGER, OTHER_FRAME])
@pytest.mark.parametrize(('places', 'odd', 'usual'), [
    ('aaab', 4, 1), ('baaa', 1, 2), ('aaba', 3, 1), ('ab', 2, 1), ('abab', 2, 1)])
@pytest.mark.parametrize('command', ['learn', 'inspect'])
def test_the_odd_one_is_named_with_its_grid_and_with_one_of_the_others(
    tmp_path, capsys, command, places, odd, usual, other,
):
    grids = {'a': GRID, 'b': other}
    task = task_of(tmp_path, [grids[place] for place in places])
    assert main([command, str(task.path)]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert f'000{odd}_demo was recorded on {other}, ' in line
    assert f'000{usual}_demo' in line.partition(' was recorded on ')[2]
    assert f'on {GRID}' in line
    assert 'this workspace' not in line


def test_taking_the_odd_one_out_as_it_is_advised_mends_it(tmp_path, capsys):
    task = task_of(tmp_path, [GRID, GRID, LARGER])
    assert main(['learn', str(task.path)]) == 2
    words = capsys.readouterr().err.split('`')[1].split()
    assert words[0] == 'experience'
    assert main(words[1:]) == 0
    assert main(['learn', str(task.path)]) == 0


def test_nothing_is_imported_into_a_mixture(tmp_path, capsys):
    task = task_of(tmp_path, [GRID, GRID, LARGER])
    bag = demonstration_bag(tmp_path / 'theirs')
    for more in ([], ['--rows', '30', '--cols', '30'], ['--like', str(task.path)]):
        assert main(['learn', str(bag), '--into', str(task.path), *more]) == 2
        assert '0003_demo was recorded on 30 x 30' in capsys.readouterr().err
    assert len(task.episodes()) == 3


def test_bags_of_one_workspace_have_the_last_ones_header(tmp_path):
    task = task_of(tmp_path, [GRID, GRID])
    start_bag(task, EpisodeKind.TRIAL, {}).close()
    task.episodes()[-1].bag.write_bytes(b'')
    assert [header.grid for header in check_workspaces(task.episodes())] == [GRID, GRID]
    assert check_workspaces([]) == []
